// three_copy.mjs IN OUT [custom]: loads a level with three.js and exports it again, as an editor on the web does.
import {readFileSync, writeFileSync} from "node:fs";
import {GLTFExporter} from "three/addons/exporters/GLTFExporter.js";
import {GLTFLoader} from "three/addons/loaders/GLTFLoader.js";

// What the exporter uses of a browser's FileReader.
globalThis.FileReader = class {
  readAsArrayBuffer(blob) {
    blob.arrayBuffer().then((bytes) => { this.result = bytes; this.onloadend(); });
  }
};
const [, , from, to, form] = process.argv;
const {scene} = await new GLTFLoader().parseAsync(new Uint8Array(readFileSync(from)).buffer, "");
const written = await new GLTFExporter().parseAsync(scene, {binary: true, includeCustomExtensions: form === "custom"});
writeFileSync(to, Buffer.from(written));
