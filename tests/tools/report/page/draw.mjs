// draw.mjs PAGE: prints the markup that a page's scripts draw.
import {readFileSync} from "node:fs";
import vm from "node:vm";

const html = readFileSync(process.argv[2], "utf8");
const contents = html.match(/id="contents">(.*?)<\/script>/s)[1], script = html.match(/<script>(.*)<\/script>/s)[1];
const context = vm.createContext({atob, contents: JSON.parse(contents)});
vm.runInContext(script, context);
console.log(vm.runInContext("pageHtml(contents)", context));
