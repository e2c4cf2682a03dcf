// pictures.mjs PAGE FOLDER: photographs a report's answer and view.
import {pathToFileURL} from "node:url";
import {chromium} from "playwright-core";

const [file, folder] = process.argv.slice(2);
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]});
const page = await browser.newPage({viewport: {width: 1000, height: 900}});
await page.goto(pathToFileURL(file).href);
await page.waitForFunction(() => window.clamorView !== undefined);
await page.waitForTimeout(300);  // the last frame
await page.locator(".view").screenshot({path: folder + "/report_view.png"});
await page.locator("figure").first().screenshot({path: folder + "/report_parameters.png"});
await browser.close();
