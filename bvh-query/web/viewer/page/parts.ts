/** Opens the files that are embedded in the page, and reads what is drawn of them. */

import type { FileSummary } from "../worker/files.js";
import type { Asker } from "./asker.js";
import { Shown } from "./bodies.js";
import type { Content, ContentPart } from "./content.js";

/** What is drawn, and how the command line names it. */
export interface Part {
    shown: Shown;
    /** The path of the file, and the name of the object if it is one of several. */
    words: string[];
}

/** Opens all files and reads the parts that are shown: those of instances, or one of each file. */
export async function openParts(
    asker: Asker,
    { files, show }: Content,
    packed: string[],
    onFile: (name: string) => void,
): Promise<Part[]> {
    const opened: FileSummary[] = [];
    for (const [k, file] of files.entries()) {
        onFile(file.name);
        opened.push(await asker.ask("openEmbedded", file.name, packed[k] ?? ""));
        // It may be large.
        packed[k] = "";
    }
    const parts: ({ name: string; file: number } & ContentPart)[] =
        "instances" in show ? show.instances : files.map((part, file) => ({ ...part, file }));
    // Each is read once, however often it is drawn.
    const read = new Map<string, Part>();
    const all: Part[] = [];
    for (const { name, file, object = -1, solid = false } of parts) {
        const [whole, path] = [opened[file], files[file]?.path];
        if (whole === undefined || path === undefined) {
            throw new Error(`${name}: expected a file below ${files.length}, found ${file}`);
        }
        const key = `${file} ${object} ${solid}`;
        let part = read.get(key);
        if (part === undefined) {
            const isPart = object >= 0 || solid;
            const summary = isPart ? await asker.ask("openPart", whole.number, object, solid) : whole;
            const words = object >= 0 ? [path, whole.objects[object] ?? ""] : [path];
            part = { shown: await Shown.of(summary, asker), words };
            read.set(key, part);
        }
        all.push(part);
    }
    return all;
}
