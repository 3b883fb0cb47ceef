/** Reads what the command has put into the page: files, and what to show of them. */

export type Numbers12 = number[];

/** Which part of a file is meant, if it is not all of it as the file says. */
export interface ContentPart {
    object?: number;
    solid?: boolean;
}

export interface ContentInstance extends ContentPart {
    name: string;
    file: number;
    pose: Numbers12;
    margin: number;
    moving: boolean;
    /** The groups that it is in, and those that it meets, as bits. */
    member: number;
    meets: number;
}

export interface ContentClash {
    a: number;
    b: number;
    class: string;
    lower?: number;
    upper?: number;
    distance?: number;
    point?: number[];
    translation?: number[];
    /** What both have in common, and how thick A and B are where they are pierced, if that was measured. */
    volume?: number;
    pierced?: [number | null, number | null];
}

export type Show =
    | { kind: "file" }
    | { kind: "pair"; pose: Numbers12; within?: number; same?: boolean }
    | { kind: "motion"; motion: number[]; clearance: number; tolerance: number | null; same?: boolean }
    | {
          kind: "scene";
          instances: ContentInstance[];
          allowed: [number, number][];
          pair_margins?: [number, number, number][];
          frames: number[][];
      }
    | { kind: "clash"; instances: ContentInstance[]; clashes: ContentClash[] };

export interface Content {
    version: 1;
    files: ({ name: string; path: string; bytes: number } & ContentPart)[];
    show: Show;
}

/** Returns the content of the page, or `undefined` of a page that is not filled. The text is removed, to free its memory. */
export function readContent(): { content: Content; packed: string[] } | undefined {
    const element = document.getElementById("cbvh-content");
    if (element === null) {
        return undefined;
    }
    const content = JSON.parse(element.textContent ?? "") as Content;
    if (content.version !== 1) {
        throw new Error(
            `this page expects content of version 1, found ${content.version}; write it again with cbvh view`,
        );
    }
    const packed = [...document.querySelectorAll("script.cbvh-file")].map((file) => {
        const text = (file.textContent ?? "").trim();
        file.remove();
        return text;
    });
    if (packed.length !== content.files.length) {
        throw new Error(`expected ${content.files.length} files in this page, found ${packed.length}; was it cut off?`);
    }
    return { content, packed };
}
