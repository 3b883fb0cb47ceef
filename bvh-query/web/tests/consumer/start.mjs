/** The first program of the book: bakes a room and a robot, and computes how near the robot comes to the room. */

import { readFile } from "node:fs/promises";
import { init, Mesh } from "cbvh";

await init();
const bake = async (path) => Mesh.bakeFile(path, await readFile(path));
const room = await bake("testdata/fclenv.obj");
const robot = await bake("testdata/fclrob.obj");
for (const z of [-500, -440, -439.5]) {
    // The rows of the 3 by 4 matrix that places the robot in the frame of the room.
    const at = [0.6, -0.8, 0, 300, 0.8, 0.6, 0, -1600, 0, 0, 1, z];
    if (room.collide(robot, at)) {
        console.log(`z = ${z}: in contact, ${room.contacts(robot, at).length / 4} pairs of triangles`);
    } else {
        const nearest = room.distance(robot, at);
        console.log(`z = ${z}: ${nearest.distance} apart, triangles ${nearest.triangleA} and ${nearest.triangleB}`);
    }
}
