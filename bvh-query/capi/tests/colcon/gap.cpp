// Prints how far two boxes are apart.
#include <cbvh.hpp>

#include <cstdio>

int main() {
    const auto box = cbvh::Mesh::box({2, 2, 2});
    const cbvh::Pose beside({1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0});
    cbvh::Querier querier;
    std::printf("%g\n", querier.distance(box, box, beside).distance);
}
