/** The first answer of a program that has just installed the package. */

import { init, Mesh } from "cbvh";

await init();
const triangle = Mesh.bake([0, 0, 0, 1, 0, 0, 0, 1, 0]);
const above = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.5];
console.log(triangle.distance(triangle, above).distance);
