// choose.mjs VIEW.json X,Y,Z K: prints the sources that a report's page chooses, as JSON.
import {readFileSync} from "node:fs";
import vm from "node:vm";

const page = new URL("../../../../tools/report/page/", import.meta.url);
const [file, place, voices] = process.argv.slice(2);
const context = vm.createContext({atob, Float32Array, Float64Array, Uint8Array, Uint16Array, Uint32Array, Math, JSON});
for (const script of ["data.js", "choice.js"]) vm.runInContext(readFileSync(new URL(script, page), "utf8"), context);
context.text = readFileSync(file, "utf8");
context.place = place.split(",").map(Number);
context.voices = Number(voices);
const {chosen} = vm.runInContext("choose(readLevel(JSON.parse(text)), place, voices, null)", context);
console.log(JSON.stringify(chosen.map(({index, scale}) => ({index, scale}))));
