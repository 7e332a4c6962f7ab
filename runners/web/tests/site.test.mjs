// The site in Chromium: `node --test site.test.mjs`. SITE is its folder, EXAMPLES those of the repository, FREDHOLM the program; screenshots go
// to SHOTS if that is given.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import http from "node:http";
import os from "node:os";
import path from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import axe from "axe-core";
import { chromium } from "playwright-core";

const { SITE, EXAMPLES, FREDHOLM, SHOTS, CHROMIUM = "/usr/bin/chromium" } = process.env;
const WIDTHS = { wide: { width: 1280, height: 900 }, narrow: { width: 390, height: 800 } };
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm", ".svg": "image/svg+xml", ".json": "application/json" };

let server, root, browser;
const foreign = [];

before(async () => {
  server = http.createServer((request, response) => {
    const file = path.join(SITE, decodeURIComponent(new URL(request.url, "http://x").pathname).replace(/\/$/, "/index.html"));
    if (!file.startsWith(SITE) || !fs.existsSync(file)) return response.writeHead(404).end();
    response.writeHead(200, { "content-type": TYPES[path.extname(file)] ?? "application/octet-stream" });
    fs.createReadStream(file).pipe(response);
  });
  await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
  root = `http://127.0.0.1:${server.address().port}`;
  const quiet = "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking --disable-component-update --disable-sync";
  browser = await chromium.launch({ executablePath: CHROMIUM, args: quiet.split(" ") });
});

after(async () => {
  await browser?.close();
  server?.close();
});

/** A page at this address of the site, or of its folder, of which requests to others and errors are noted. */
const pageAt = async (address, options = { viewport: WIDTHS.wide }) => {
  const page = await browser.newPage(options);
  page.errors = [];
  page.on("request", (request) => {
    if (!request.url().startsWith(root) && !/^(blob|data|file):/.test(request.url())) foreign.push(request.url());
  });
  page.on("pageerror", (error) => page.errors.push(error.message));
  page.on("console", (message) => message.type() === "error" && !/blob:/.test(message.location().url) && page.errors.push(`${message.text()} ${message.location().url}`));
  await page.goto(address.startsWith("file:") ? address : `${root}/${address}`);
  return page;
};

const playground = async (tab, options) => pageAt(`play/index.html#${tab}`, options);
const panel = (page, tab) => page.locator(`#${tab}`);
const says = (page, tab, text, timeout = 60_000) => panel(page, tab).locator(".status").filter({ hasText: text }).waitFor({ timeout });
/** Waits until nothing is computed. */
const idle = async (page, tab) => {
  // What was typed is taken up a little later.
  await page.waitForTimeout(500);
  await page.locator(`#${tab}[aria-busy="false"]`).waitFor({ timeout: 120_000 });
};
const shot = async (page, name) => SHOTS && (await page.screenshot({ path: path.join(SHOTS, `${name}.png`) }));

/** Serious and lesser violations that axe finds. */
const violations = async (page) => {
  await page.evaluate(axe.source);
  const { violations } = await page.evaluate(() => globalThis.axe.run());
  return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target).join(", ")}`);
};

/** A report without its times. */
const withoutTimes = (value) => {
  if (Array.isArray(value)) return value.map(withoutTimes);
  if (value === null || typeof value !== "object") return value;
  return Object.fromEntries(Object.entries(value).filter(([key]) => !/seconds/.test(key)).map(([key, own]) => [key, withoutTimes(own)]));
};

test("every example has the program's bits", { timeout: 3_600_000 }, async (t) => {
  const page = await pageAt("404.html");
  await page.addScriptTag({ url: `${root}/solver/solver.js` });
  for (const name of fs.readdirSync(EXAMPLES).filter((name) => name.endsWith(".toml"))) {
    await t.test(name, async () => {
      const text = fs.readFileSync(path.join(EXAMPLES, name), "utf8");
      const beside = fs.readdirSync(EXAMPLES).filter((other) => text.includes(`"${other}"`));
      const begun = performance.now();
      const found = await page.evaluate(
        async ([name, beside]) => {
          globalThis.solver ??= new fredholm.Solver();
          const files = Object.fromEntries([name, ...beside].map((own) => [own, fredholm.examples[own]]));
          const answer = await solver.solve(name, files);
          return [answer.json, answer.table];
        },
        [name, beside],
      );
      const seconds = (performance.now() - begun) / 1000;
      const since = performance.now();
      const { stdout: printed } = spawnSync(FREDHOLM, ["solve", name, "--json", "--threads", "1"], { cwd: EXAMPLES, encoding: "utf8", maxBuffer: 1 << 28 });
      const native = (performance.now() - since) / 1000;
      // Numbers are printed with all digits that tell them apart.
      assert.deepStrictEqual(...[found[0], printed].map((json) => withoutTimes(JSON.parse(json))));
      const [here, there] = [JSON.parse(found[0]), JSON.parse(printed)].map((report) => report.walk_seconds ?? report.summary?.walk_seconds);
      t.diagnostic(`${name}: ${seconds.toFixed(1)} s in the browser, ${native.toFixed(1)} s by the program on one thread; walks ${here?.toFixed(3)} and ${there?.toFixed(3)} s: ${(there / here).toFixed(2)} of its speed`);
    });
  }
});

/** Notes tasks that block the page. */
const watched = async (tab, options = { viewport: WIDTHS.wide }) => {
  const page = await pageAt("404.html", options);
  await page.addInitScript(() => {
    globalThis.longest = 0;
    new PerformanceObserver((list) => list.getEntries().forEach(({ duration }) => (globalThis.longest = Math.max(globalThis.longest, duration)))).observe({ type: "longtask", buffered: true });
  });
  await page.goto(`${root}/play/index.html#${tab}`);
  return page;
};
const MOST_BLOCKED = 100;
const isNeverBlocked = async (t, page) => {
  const longest = await page.evaluate(() => globalThis.longest);
  t.diagnostic(`the longest task took ${longest.toFixed(0)} ms (0: none took 50)`);
  assert(longest < MOST_BLOCKED, `a task took ${longest} ms`);
};

/** The text of the file that a tab lets one save. */
const downloaded = async (page, tab) => {
  const coming = page.waitForEvent("download");
  await panel(page, tab).getByRole("button", { name: "Download the problem file" }).click();
  const saved = await (await coming).path();
  return fs.readFileSync(saved, "utf8");
};

/** Stops what is computed; nothing has blocked the page or gone wrong so far. */
const stops = async (t, page, tab, [begins, ends] = [20_000, 10_000]) => {
  await panel(page, tab).getByRole("button", { name: "Stop" }).click({ timeout: begins });
  await says(page, tab, /stopped/, ends);
  await isNeverBlocked(t, page);
  assert.deepEqual(page.errors, []);
  await page.close();
};

/** What the program prints of a text, without lines with times. */
const printedBy = (text, folder = fs.mkdtempSync(path.join(os.tmpdir(), "fredholm-web-"))) => {
  fs.writeFileSync(path.join(folder, "own.toml"), text);
  const { stdout, stderr } = spawnSync(FREDHOLM, ["solve", "own.toml"], { cwd: folder, encoding: "utf8" });
  return timeless(stderr + stdout);
};
const timeless = (text) => text.split("\n").filter((line) => !/\d s(,|$)/.test(line)).join("\n").trim();
const printedIn = async (page, tab) => timeless(await panel(page, tab).locator(".printed").textContent());

/** Shares a problem and opens its address elsewhere. */
const reopened = async (page, tab) => {
  await panel(page, tab).getByRole("button", { name: "Share" }).click();
  await page.waitForFunction((tab) => location.hash.startsWith(`#${tab}=`), tab);
  return pageAt(page.url().slice(root.length + 1));
};

test("an equation: typed, refused, shared, saved, stopped", { timeout: 300_000 }, async (t) => {
  const page = await watched("equation");
  await page.locator("#equation [data-plot=u] polyline").waitFor();
  const first = await page.evaluate(() => performance.now());
  t.diagnostic(`the first result is there ${(first / 1000).toFixed(2)} s after opening`);
  assert(first < 2000, `${first} ms`);
  await idle(page, "equation");

  const field = (name) => panel(page, "equation").locator(`[name="${name}"]`);
  await field("kernel").fill("0.5 * exp(-(x - z)^2)");
  const refused = page.locator("#equation-kernel-wrong");
  await refused.waitFor();
  assert.match(await refused.textContent(), /z/);
  assert.equal(await field("kernel").getAttribute("aria-invalid"), "true");
  await shot(page, "equation-refused");
  await field("kernel").fill("0.5 * exp(-(x - y)^2)");
  await field("error").fill("nothing");
  await page.locator("#equation-error-wrong").waitFor();
  await field("error").fill("1e-7");
  await field("to").fill("2");
  await idle(page, "equation");
  assert.equal(await page.locator("#equation [aria-invalid]").count(), 0);
  assert.equal(await printedIn(page, "equation"), printedBy(await downloaded(page, "equation")));
  const worst = (await panel(page, "equation").locator("[data-plot=u] svg").getAttribute("aria-label")).match(/[\d.]+e-\d+/);
  assert(Number(worst[0]) < 3e-7);
  const told = await panel(page, "equation").locator("[data-plot=residual] svg").getAttribute("aria-label");
  const [left] = told.match(/[\d.]+e[+-]\d+/);
  assert(Number(left) < 3e-7 && Number(left) > 0, told);

  const other = await reopened(page, "equation");
  await idle(other, "equation");
  assert.equal(await other.locator("#equation [name=kernel]").inputValue(), "0.5 * exp(-(x - y)^2)");
  assert.equal(await other.locator("#equation [name=to]").inputValue(), "2");
  await other.close();

  await field("kernel").fill("0.5 * abs(sin(40 * x * y))");
  await field("error").fill("1e-13");
  await stops(t, page, "equation");
});

test("a room: drawn, dragged, refused, shared, saved, stopped", { timeout: 300_000 }, async (t) => {
  const page = await watched("room");
  const room = panel(page, "room");
  await idle(page, "room");
  const picture = () => room.locator("[data-plot=light]").evaluate((canvas) => canvas.toDataURL());
  const before = await picture();
  const box = await room.locator("[data-plot=light]").boundingBox();
  const drag = async (from, to) => {
    await page.mouse.move(box.x + from[0] * box.width, box.y + from[1] * box.height);
    await page.mouse.down();
    await page.mouse.move(box.x + to[0] * box.width, box.y + to[1] * box.height, { steps: 8 });
    await page.mouse.up();
  };
  await room.getByLabel("draws a lamp").check();
  await drag([0.15, 0.15], [0.25, 0.2]);
  assert.deepEqual(await room.locator("[name=thing] option").allTextContents(), ["walls", "lamp", "table", "cupboard", "screen", "lamp 1"]);
  await idle(page, "room");
  assert.notEqual(await picture(), before);
  assert.equal(await printedIn(page, "room"), printedBy(await downloaded(page, "room")));
  await room.getByLabel("moves a thing").check();
  await drag([0.2, 0.175], [0.3, 0.3]);
  await idle(page, "room");
  await room.locator("[data-plot=light]").press("ArrowDown");
  await idle(page, "room");
  await shot(page, "room-drawn");
  await room.getByLabel("draws a block").check();
  await room.locator("[data-plot=light]").press("Enter");
  await idle(page, "room");
  assert.equal(await room.locator("[name=thing] option").count(), 7);
  await room.locator("[data-plot=light]").press("Delete");
  await idle(page, "room");

  const other = await reopened(page, "room");
  await idle(other, "room");
  assert.equal(await printedIn(other, "room"), await printedIn(page, "room"));
  await other.close();

  await room.locator("[name=reflectance]").fill("2");
  const told = page.locator("#room-reflectance-wrong");
  assert.match(await told.textContent(), /from 0 to 1/);
  await room.locator("[name=reflectance]").fill("0.2");
  await room.locator("[name=walks]").fill("1000");
  await stops(t, page, "room");
});

// A box with a lid that is open, and a step in it.
const OBJ = `v 0 0 0
v 2 0 0
v 2 1 0
v 0 1 0
v 0 0 1
v 2 0 1
v 2 1 1
v 0 1 1
g floor
f 1 2 3 4
g back
f 4 3 7 8
g left
f 1 4 8 5
`;

test("a scene: dropped, turned, clicked, refused, shared, stopped", { timeout: 600_000 }, async (t) => {
  const page = await watched("scene");
  const scene = panel(page, "scene");
  await idle(page, "scene");
  const picture = () => scene.locator("[data-plot=view]").evaluate((canvas) => canvas.toDataURL());
  const before = await picture();
  await scene.locator("[data-plot=view]").press("ArrowLeft");
  await page.waitForTimeout(200);
  assert.notEqual(await picture(), before);
  for (const what of ["error", "irradiance"]) {
    await scene.locator("[name=colour]").selectOption(what);
    await page.waitForTimeout(100);
    assert(Number(await scene.locator("[data-value=high]").textContent()) > 0);
  }
  await shot(page, "scene-irradiance");
  await scene.locator("[name=colour]").selectOption("factors");
  await scene.locator("[data-plot=view]").click();
  await scene.locator(".factors tbody tr").first().waitFor();
  const sum = Number((await scene.locator("[data-value=picked]").textContent()).match(/([\d.]+)\.$/)[1]);
  assert(sum > 0.2 && sum <= 1.0001, `${sum}`);

  const dropped = await page.evaluateHandle((text) => {
    const data = new DataTransfer();
    data.items.add(new File([text], "box.obj"));
    return data;
  }, OBJ);
  await page.dispatchEvent("body", "drop", { dataTransfer: dropped });
  await idle(page, "scene");
  assert.match(await downloaded(page, "scene"), /mesh = "box\.obj"/);
  assert(Number(await scene.locator("[data-value=high]").textContent()) > 0.1);
  const other = await reopened(page, "scene");
  await idle(other, "scene");
  assert.equal(await printedIn(other, "scene"), await printedIn(page, "scene"));
  await shot(other, "scene-dropped");
  await other.close();

  await scene.locator("[name=file]").setInputFiles({ name: "broken.obj", mimeType: "text/plain", buffer: Buffer.from("f 1 2 3\n") });
  await page.locator("#scene-file-wrong").waitFor();
  assert.match(await page.locator("#scene-file-wrong").textContent(), /broken\.obj/);
  await scene.locator("[name=example]").selectOption("living-room.toml");
  await scene.locator("[name=walks]").fill("100000000");
  // What was typed is taken up a little later.
  await page.waitForTimeout(1500);
  await stops(t, page, "scene", [60_000, 20_000]);
});

test("the manual: a problem file runs, and every one has a button", { timeout: 300_000 }, async (t) => {
  const page = await pageAt("docs/cubes.html");
  await page.locator(".run button").first().click();
  await page.locator(".run pre").first().waitFor({ timeout: 60_000 });
  const own = timeless(await page.locator(".run pre").first().textContent());
  const blocks = (await page.locator("main pre > code").allTextContents()).map(timeless);
  assert(blocks.includes(own), own);
  assert(await page.locator(".katex math").count() > 0);
  await shot(page, "manual-run");
  let files = 0;
  for (const name of fs.readdirSync(path.join(SITE, "docs")).filter((name) => name.endsWith(".html"))) {
    await page.goto(`${root}/docs/${name}`);
    const problems = (await page.locator("main pre > code.language-toml").allTextContents()).filter((text) => /^\[problem\]/m.test(text));
    assert.equal(await page.locator(".run button").filter({ hasText: "Run" }).count(), problems.length, name);
    files += problems.length;
  }
  t.diagnostic(`${files} problem files`);
  assert(files > 20);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("without a server: from the files of a folder", { timeout: 300_000 }, async (t) => {
  const page = await pageAt(`file://${SITE}/play/index.html#equation`);
  await page.locator("#equation [data-plot=u] polyline").waitFor();
  await idle(page, "equation");
  assert.equal(await printedIn(page, "equation"), printedBy(await downloaded(page, "equation")));
  for (const tab of ["room", "scene"]) {
    await page.locator(`#tab-${tab}`).click();
    await idle(page, tab);
    assert((await printedIn(page, tab)).length > 100);
  }
  await page.locator("#scene [name=walks]").fill("100000000");
  await page.waitForTimeout(1500);
  await panel(page, "scene").getByRole("button", { name: "Stop" }).click({ timeout: 60_000 });
  await says(page, "scene", /stopped/, 20_000);
  assert.deepEqual(page.errors, []);
  await page.goto(`file://${SITE}/docs/cubes.html`);
  await page.locator(".run button").first().click();
  await page.locator(".run pre").first().waitFor({ timeout: 60_000 });
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("axe finds nothing, in light and dark, on two widths", { timeout: 1_200_000 }, async () => {
  const found = [];
  const examine = async (page, what) => {
    found.push(...(await violations(page)).map((violation) => `${what}: ${violation}`));
    const [inner, whole] = await page.evaluate(() => [innerWidth, document.documentElement.scrollWidth]);
    if (whole > inner) found.push(`${what}: it is ${whole} wide`);
  };
  for (const colorScheme of ["light", "dark"]) {
    for (const [name, viewport] of Object.entries(WIDTHS)) {
      for (const tab of ["equation", "room", "scene"]) {
        const page = await playground(tab, { viewport, colorScheme });
        await idle(page, tab);
        await examine(page, `${tab} ${name} ${colorScheme}`);
        if (colorScheme === "light" || name === "wide") await shot(page, `${tab}-${name}-${colorScheme}`);
        await page.close();
      }
      const manual = fs.readdirSync(path.join(SITE, "docs")).filter((name) => name.endsWith(".html"));
      for (const file of ["index.html", ...manual.map((name) => `docs/${name}`)]) {
        const page = await pageAt(file, { viewport, colorScheme });
        await examine(page, `${file} ${name} ${colorScheme}`);
        if (file === "docs/rooms.html") await shot(page, `manual-${name}-${colorScheme}`);
        await page.close();
      }
    }
  }
  assert.deepEqual(found, []);
});

test("no link is dead", () => {
  const names = fs.readdirSync(SITE, { recursive: true }).filter((name) => name.endsWith(".html"));
  const texts = new Map(names.map((name) => [name, fs.readFileSync(path.join(SITE, name), "utf8")]));
  const dead = [];
  let links = 0;
  for (const [name, text] of texts) {
    for (const [, quoted] of text.matchAll(/(?:href|src)="([^"]+)"/g)) {
      const link = new URL(quoted.replaceAll("&amp;", "&"), `http://site/${name}`);
      if (link.host !== "site" || /^(data|javascript):/.test(quoted)) continue;
      links += 1;
      const file = decodeURIComponent(link.pathname.slice(1)).replace(/(^|\/)$/, "$1index.html");
      const id = decodeURIComponent(link.hash.slice(1));
      const isThere = fs.existsSync(path.join(SITE, file)) && (!id || !texts.has(file) || file.startsWith("play/") || texts.get(file).includes(`id="${id}"`));
      if (!isThere) dead.push(`${name}: ${quoted}`);
    }
  }
  assert(links > 500, `${links}`);
  assert.deepEqual(dead, []);
});

test("no other host was asked for anything", () => assert.deepEqual(foreign, []));
