/** Unpacks the page's code, and runs it. It is the only code that stands in the page as it is.
 *
 * Code is gzip in base 85, as `bundle.js` writes it: five digits for each four bytes, the most significant first. */

window.cbvhUnpack = async (id) => {
    const element = document.getElementById(id);
    const text = element.textContent;
    element.remove();
    const words = new DataView(new ArrayBuffer(4 * Math.ceil(text.length / 5)));
    for (let place = 0; place < text.length; place += 5) {
        let word = 0;
        for (let digit = place; digit < place + 5; digit++) {
            // Digits that the last word does not have count as the largest ones: so its bytes, which are rounded down, are right.
            const code = digit < text.length ? text.charCodeAt(digit) : 126;
            word = 85 * word + code - 40 - (code > 60) - (code > 62);
        }
        words.setUint32((4 * place) / 5, word);
    }
    const packed = new Uint8Array(words.buffer, 0, Math.floor((4 * text.length) / 5));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).arrayBuffer();
};

(async () => {
    const root = document.documentElement;
    try {
        const code = document.createElement("script");
        code.textContent = new TextDecoder().decode(await window.cbvhUnpack("cbvh-main"));
        document.body.append(code);
    } catch (error) {
        const message = `This browser cannot unpack the page: ${error.message}. Chrome 100, Firefox 113 and Safari 16.4 can.`;
        root.dataset.state = "error";
        root.dataset.message = message;
        document.getElementById("loading").textContent = message;
    }
})();
