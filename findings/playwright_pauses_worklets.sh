#!/usr/bin/env bash
# playwright-core 1.55.1: audioWorklet.addModule() never ends: it neither resolves nor rejects, whatever the module.
#
# Playwright asks Chromium to pause each new target until it has attached to it. Chromium counts worklets among the
# targets, 1.55.1 does not know them, and so leaves an audio worklet paused at its first line. Without Playwright the
# same browser loads the same module; nothing is logged, and a context that is made later, on the thread that is then
# there, may load its module. 1.65.1 lets worklets run.
#
# It concerns tests of Web Audio: a player that works by hand waits for ever in its test. Take a newer Playwright.
# The test of Clamor's report takes 1.65.1.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . @sparticuz/chromium@141.0.0 old@npm:playwright-core@1.55.1 \
  new@npm:playwright-core@1.65.1

echo '<title>a page</title>' >page.html
cat >run.mjs <<'EOF'
import browser_package from "@sparticuz/chromium";
const executablePath = await browser_package.executablePath();
for (const [name, library] of [["1.55.1", "old"], ["1.65.1", "new"]]) {
  const {chromium} = await import(library);
  const browser = await chromium.launch({executablePath, args: ["--no-sandbox", "--disable-gpu"]});
  const page = await browser.newPage();
  await page.goto(new URL("page.html", import.meta.url).href);
  const what = await page.evaluate(() => {
    const late = new Promise((resolve) => setTimeout(resolve, 8000, "has not ended after 8 s"));
    const loaded = new OfflineAudioContext(1, 128, 48000).audioWorklet.addModule("data:text/javascript,1");
    return Promise.race([loaded.then(() => "resolves", () => "rejects"), late]);
  });
  console.log(`playwright-core ${name}: addModule() ${what}`);
  await browser.close();
}
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
playwright-core 1.55.1: addModule() has not ended after 8 s
playwright-core 1.65.1: addModule() resolves
EOF
cmp -s seen expected || { echo "What Playwright does with worklets has changed."; exit 1; }
