"""A script for pages that counts the objects of WebGL2 that are alive, `gpuObjects`."""

COUNT = """() => {
    const alive = window.gpuObjects = {};
    const prototype = WebGL2RenderingContext.prototype;
    const names = ["Buffer", "Texture", "Framebuffer", "Renderbuffer", "VertexArray", "Program", "Shader",
        "Sampler", "Query", "TransformFeedback"];
    const pairs = names.map((name) => [name, `create${name}`, `delete${name}`]);
    for (const [name, create, remove] of [...pairs, ["Sync", "fenceSync", "deleteSync"]]) {
        const held = new Set();
        const made = prototype[create];
        const removed = prototype[remove];
        Object.defineProperty(alive, name, { enumerable: true, get: () => held.size });
        prototype[create] = function (...given) {
            const object = made.apply(this, given);
            if (object) held.add(object);
            return object;
        };
        prototype[remove] = function (object) {
            held.delete(object);
            return removed.call(this, object);
        };
    }
}"""
