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

/** A shape that a joint of a robot carries. Shapes of one body have one name. */
export interface ContentCarried extends ContentInstance {
    /** 0 is the world, and each joint moves the next frame. */
    frame: number;
    /** Where it is in that frame. */
    origin: Numbers12;
}

export interface ContentJoint {
    kind: "turn" | "slide" | "planar" | "floating";
    /** The frame that it hangs from, and where it is there. */
    parent: number;
    origin: Numbers12;
    axis: [number, number, number];
    /** The place of its value, or of the first of them, and by what that is multiplied and moved. */
    value: number;
    factor: number;
    offset: number;
}

export interface ContentValue {
    name: string;
    /** What it is in the poses of the instances. */
    at: number;
    /** The ends of its slider; `null` leaves them to the page. */
    lower: number | null;
    upper: number | null;
}

/** A configuration or, with a goal, an edge, which may end before its goal. */
export interface ContentLine {
    start: number[];
    goal?: number[];
    end?: {
        hit: boolean;
        free_until: number;
        at: number;
        bodies: [string, string];
        points: [number[], number[]];
    };
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
    | { kind: "clash"; instances: ContentInstance[]; clashes: ContentClash[] }
    | {
          kind: "robot";
          instances: ContentCarried[];
          allowed: [number, number][];
          joints: ContentJoint[];
          values: ContentValue[];
          lines: ContentLine[];
      };

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
