// Makes the sources of the book: `node make.mjs REPOSITORY FOLDER`. Pages are the README, the manual and whatever pages they link to; what else they link to
// is copied beside them, and formulas are typeset.
import fs from "node:fs";
import path from "node:path";
import katex from "katex";

const [repository, folder] = process.argv.slice(2);
const pages = path.join(folder, "pages");
const from = (file) => path.join(repository, file);
/** Where a file of the repository is in the book, whose folders have an index. */
const placed = (file) => file.replace(/README\.md$/, "index.md");
const write = (file, content) => {
  const place = path.join(pages, placed(file));
  fs.mkdirSync(path.dirname(place), { recursive: true });
  fs.writeFileSync(place, content);
};

const titles = new Map();
const open = ["README.md", "docs/README.md", ...fs.readdirSync(from("docs")).filter((name) => name.endsWith(".md")).map((name) => `docs/${name}`)];

/** What a link of a page should be: pages and files are taken along, folders are their README. */
const linked = (page, text, target) => {
  if (/^(https?:|#|mailto:)/.test(target)) return `[${text}](${target})`;
  const [name, fragment] = target.split("#");
  let file = path.normalize(path.join(path.dirname(page), name));
  if (fs.existsSync(from(file)) && fs.statSync(from(file)).isDirectory()) file = path.join(file, "README.md");
  // A folder without a page of its own.
  if (!fs.existsSync(from(file))) return text;
  if (file.endsWith(".md")) open.push(file);
  else write(file, fs.readFileSync(from(file)));
  const to = path.relative(path.dirname(page), placed(file)) + (fragment ? `#${fragment}` : "");
  return `[${text}](${to})`;
};

const typeset = (formula) => `<div>${katex.renderToString(formula, { displayMode: true }).replaceAll("\n", " ")}</div>\n`;

/** A page for mdBook: code stays as it is. */
const converted = (page, text) => {
  const parts = text.split(/^(```[^]*?^```$)/m);
  return parts
    .map((part) => {
      const formula = part.match(/^```math\n([^]*)\n```$/);
      if (formula) return typeset(formula[1]);
      if (part.startsWith("```")) return part;
      return part.replace(/(?<!`)\[((?:[^\][]|\[[^\][]*\])*)\]\(([^()\s]+)\)/g, (_, words, target) => linked(page, words, target));
    })
    .join("");
};

while (open.length) {
  const page = open.shift();
  if (titles.has(page)) continue;
  const text = fs.readFileSync(from(page), "utf8");
  const prose = text.replace(/^```[^]*?^```$/gm, "");
  titles.set(page, prose.match(/^#+ (.*)$/m)?.[1] ?? page);
  write(page, converted(page, text));
}

// The order of the manual's own index, whose bold rows are headings.
const summary = ["# Summary\n", `[${titles.get("README.md")}](index.md)`, "[The manual](docs/index.md)\n"];
const listed = new Set(["README.md", "docs/README.md"]);
for (const row of fs.readFileSync(from("docs/README.md"), "utf8").matchAll(/^\| (?:\*\*(.+)\*\*|\[(.+)\]\(([^)]+)\)) \|/gm)) {
  const [, heading, name, target] = row;
  if (heading) summary.push(`\n# ${heading}\n`);
  else {
    const page = path.normalize(path.join("docs", target));
    listed.add(page);
    summary.push(`- [${name}](${placed(page)})`);
  }
}
const rest = [...titles.keys()].filter((page) => !listed.has(page));
summary.push("\n# The crates\n", ...rest.map((page) => `- [${titles.get(page)}](${placed(page)})`));
write("SUMMARY.md", summary.join("\n") + "\n");

const examples = fs.readdirSync(from("examples")).map((name) => [name, fs.readFileSync(from(`examples/${name}`), "utf8")]);
examples.forEach(([name, text]) => write(`examples/${name}`, text));
fs.writeFileSync(path.join(folder, "..", "examples.json"), JSON.stringify(Object.fromEntries(examples)));
