// Times PQP on poses: pqp MESH POSES..., a mesh against itself. MESH has nine doubles per triangle, a line of POSES twelve numbers.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <vector>

#include "PQP.h"

const int QUEUE = 1000; // the length of PQP's priority queue for distances; the default of 2 is slower on these meshes

int main(int count, char** names) {
    std::ifstream file(names[1], std::ios::binary);
    PQP_Model models[2];
    double corners[9];
    for (auto& model : models) model.BeginModel();
    for (int id = 0; file.read(reinterpret_cast<char*>(corners), sizeof corners); id++)
        for (auto& model : models) model.AddTri(corners, corners + 3, corners + 6, id);
    for (auto& model : models) model.EndModel();

    PQP_REAL still[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, nowhere[3] = {0, 0, 0};
    for (int name = 2; name < count; name++) {
        std::vector<std::vector<double>> poses;
        std::ifstream lines(names[name]);
        std::vector<double> pose(12);
        while ([&] { for (auto& number : pose) lines >> number; return bool(lines); }()) poses.push_back(pose);
        for (const bool distance : {false, true}) {
            std::vector<double> answers(poses.size()), least(poses.size(), 1e30);
            for (int round = 0; round < 4; round++) // the first one fills the caches
                for (size_t i = 0; i < poses.size(); i++) {
                    const auto& p = poses[i];
                    PQP_REAL r[3][3] = {{p[0], p[1], p[2]}, {p[4], p[5], p[6]}, {p[8], p[9], p[10]}}, t[3] = {p[3], p[7], p[11]};
                    const auto start = std::chrono::steady_clock::now();
                    if (distance) {
                        PQP_DistanceResult result;
                        PQP_Distance(&result, still, nowhere, &models[0], r, t, &models[1], 0, 0, QUEUE);
                        answers[i] = result.Distance();
                    } else {
                        PQP_CollideResult result;
                        PQP_Collide(&result, still, nowhere, &models[0], r, t, &models[1], PQP_FIRST_CONTACT);
                        answers[i] = result.NumPairs();
                    }
                    const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - start;
                    if (round > 0) least[i] = std::min(least[i], took.count());
                }
            const char* mode = distance ? "distance" : "collide";
            std::printf("{\"bytes\": %d, \"mode\": \"%s\", \"poses\": \"%s\"", models[0].MemUsage(0), mode, names[name]);
            for (const auto* list : {&answers, &least}) {
                std::printf(", \"%s\": [", list == &answers ? "answers" : "ns");
                for (size_t i = 0; i < list->size(); i++) std::printf("%s%.17g", i ? ", " : "", (*list)[i]);
                std::printf("]");
            }
            std::printf("}\n");
        }
    }
}
