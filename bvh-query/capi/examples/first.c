/* The first program: bakes a tetrahedron, and asks whether two of them touch and how far apart they are. */
#include <cbvh.h>
#include <stdio.h>
#include <stdlib.h>

/* Ends the program if a function failed. */
static void check(cbvh_status status) {
    if (status != CBVH_OK) {
        fprintf(stderr, "cbvh: %s\n", cbvh_last_message());
        exit(1);
    }
}

int main(void) {
    const double vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const uint32_t faces[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    cbvh_mesh tetrahedron;
    cbvh_querier querier;
    check(cbvh_bake(vertices, 4, faces, 4, NULL, &tetrahedron));
    check(cbvh_querier_new(CBVH_BACKEND_BEST, &querier));

    /* Where the second one is in the frame of the first: touching it with a corner, and half a unit further. */
    cbvh_pose poses[2] = {CBVH_IDENTITY, CBVH_IDENTITY};
    poses[0].rows[3] = 1;
    poses[1].rows[3] = 1.5;
    bool touching[2];
    cbvh_distance_answer distances[2];
    check(cbvh_collide(querier, tetrahedron, tetrahedron, poses, 2, touching));
    check(cbvh_distances(querier, tetrahedron, tetrahedron, poses, 2, NULL, distances));
    for (int i = 0; i < 2; i++) {
        printf("%s, distance %g\n", touching[i] ? "touching" : "apart", distances[i].distance);
    }

    /* A turn is not a scale: mistakes have a message. */
    poses[0].rows[0] = 2;
    cbvh_status refused = cbvh_collide(querier, tetrahedron, tetrahedron, poses, 2, touching);
    printf("refused: %s\n", cbvh_last_message());

    check(cbvh_querier_free(querier));
    check(cbvh_mesh_free(tetrahedron));
    const bool is_right = touching[0] && !touching[1] && distances[0].distance == 0 && distances[1].distance == 0.5 &&
                          refused == CBVH_INVALID_ARGUMENT;
    return is_right ? 0 : 1;
}
