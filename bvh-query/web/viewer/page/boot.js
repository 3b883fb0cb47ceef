/** Unpacks the page's code, and runs it. It is the only code that stands in the page as it is. */

window.cbvhUnpack = async (id) => {
    const element = document.getElementById(id);
    const letters = atob(element.textContent);
    element.remove();
    const packed = new Uint8Array(letters.length);
    for (let place = 0; place < letters.length; place++) {
        packed[place] = letters.charCodeAt(place);
    }
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
