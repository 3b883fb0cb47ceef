/** Unpacks parts of this page: gzip in base 85, in elements that run no code. */

/** The function that unpacked this code. */
declare global {
    interface Window {
        cbvhUnpack: (id: string) => Promise<ArrayBuffer>;
    }
}

export const unpack = (id: string): Promise<ArrayBuffer> => window.cbvhUnpack(id);

export const unpackText = async (id: string): Promise<string> => new TextDecoder().decode(await unpack(id));
