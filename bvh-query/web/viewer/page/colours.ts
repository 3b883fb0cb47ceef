/** The colours of the stage, in a dark and a light page, and scales of colours. */

import type { Color } from "three";

export interface Palette {
    background: number;
    grid: number;
    gridCentre: number;
    a: number;
    b: number;
    still: number;
    moving: number;
    hit: number;
    near: number;
    depth: number;
    /** What two meshes have in common. */
    shared: number;
    normal: number;
    select: number;
    box: number;
}

const LIGHT: Palette = {
    background: 0xf3f5f8,
    grid: 0xd9dee6,
    gridCentre: 0xc3cad6,
    a: 0x7d9cc9,
    b: 0xe0a95c,
    still: 0xa3adbd,
    moving: 0xe0a95c,
    hit: 0xdc2f4b,
    near: 0x0b8f62,
    depth: 0x7a35d6,
    shared: 0x00a3ad,
    normal: 0x0369c4,
    select: 0x111827,
    box: 0x2f5fb3,
};

const DARK: Palette = {
    background: 0x101318,
    grid: 0x232932,
    gridCentre: 0x343c49,
    a: 0x7d9fd4,
    b: 0xe2ac62,
    still: 0x7c8799,
    moving: 0xe2ac62,
    hit: 0xff4d67,
    near: 0x3ddc97,
    depth: 0xb889ff,
    shared: 0x3fe0e8,
    normal: 0x62b6ff,
    select: 0xffffff,
    box: 0x8fb7ff,
};

export const palette = (dark: boolean): Palette => (dark ? DARK : LIGHT);

/** A colour that differs from those of the numbers near it. */
export function distinct(number: number, colour: Color): Color {
    const hue = (number * 0.618033988749895) % 1;
    return colour.setHSL(hue, 0.5 + 0.12 * (number % 3), 0.56 + 0.07 * (number % 2));
}

/** From cool grey over yellow to red, for shares from 0 to 1: stops of red, green and blue. */
const HEAT: readonly [number, number, number][] = [
    [0.42, 0.47, 0.56],
    [0.24, 0.44, 0.8],
    [0.18, 0.68, 0.6],
    [0.95, 0.79, 0.25],
    [0.95, 0.45, 0.2],
    [0.85, 0.12, 0.25],
];

export function heat(share: number, colour: Color): Color {
    const place = Math.min(Math.max(share, 0), 1) * (HEAT.length - 1);
    const low = Math.min(Math.floor(place), HEAT.length - 2);
    const [from, to] = [HEAT[low] ?? [0, 0, 0], HEAT[low + 1] ?? [0, 0, 0]];
    const mix = from.map((value, k) => value + (place - low) * ((to[k] ?? 0) - value));
    return colour.setRGB(mix[0] ?? 0, mix[1] ?? 0, mix[2] ?? 0, "srgb");
}
