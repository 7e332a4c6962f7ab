// A button beside every problem file of the manual, which solves it in the page. What is printed is compared with what stands below.
import { gridPlots } from "./plot.js";

(() => {
  const root = new URL(path_to_root || ".", location.href.replace(/[^/]*$/, ""));
  const blocks = [...document.querySelectorAll("main pre > code")];
  const nameOf = (text) => text.match(/^# ([\w.-]+\.\w+)/)?.[1];

  /** Files of the page by their names, and examples that the text names. */
  const filesFor = (text) => {
    const named = blocks.map((block) => block.textContent).filter(nameOf);
    const files = Object.fromEntries(named.map((content) => [nameOf(content), content]));
    const examples = Object.entries(fredholm.examples).filter(([name]) => text.includes(`"${name}"`));
    return { ...Object.fromEntries(examples), ...files };
  };

  /** Loads a script of the site. */
  const load = (address) =>
    new Promise((resolve, reject) => {
      const missing = () => reject(new Error("the solver did not start: its files are missing"));
      document.head.append(make("script", { src: new URL(address, root), onload: resolve, onerror: missing }));
    });

  let solver;
  const run = async (code, [button, stop, status, printed, pictures]) => {
    const text = code.textContent;
    const name = nameOf(text) ?? "problem.toml";
    button.disabled = true;
    stop.hidden = false;
    printed.hidden = true;
    pictures.replaceChildren();
    status.classList.remove("wrong");
    status.textContent = "starting";
    try {
      if (!globalThis.fredholm) await load("solver/solver.js");
      solver ??= new fredholm.Solver();
      const answer = await solver.solve(name, { ...filesFor(text), [name]: text }, (walked, expected) => {
        const share = expected > 0 ? `${Math.min(100, Math.round((100 * walked) / expected))} %` : "";
        status.textContent = walked > 0 ? `${walked} walks ${share}` : "setting up";
      });
      status.textContent = answer === null ? "stopped before the walks" : "";
      printed.textContent = answer === null ? "" : [...answer.said, answer.table].join("\n");
      printed.hidden = answer === null;
      pictures.replaceChildren(...(answer === null ? [] : gridPlots(answer)));
    } catch (error) {
      status.classList.add("wrong");
      status.textContent = error.message;
    }
    button.disabled = false;
    stop.hidden = true;
  };

  const make = (name, properties, ...children) => {
    const made = Object.assign(document.createElement(name), properties);
    made.append(...children);
    return made;
  };
  for (const code of blocks) {
    if (!code.matches(".language-toml") || !/^\[problem\]/m.test(code.textContent)) continue;
    const button = make("button", { type: "button", textContent: "Run" });
    const stop = make("button", { type: "button", textContent: "Stop", hidden: true });
    const status = make("span", { role: "status" });
    const printed = make("pre", { hidden: true, tabIndex: 0 });
    const parts = [button, stop, status, printed, make("div", { className: "pictures" })];
    button.addEventListener("click", () => run(code, parts));
    stop.addEventListener("click", () => solver?.stop());
    code.parentElement.after(make("div", { className: "run" }, ...parts));
  }
  // What scrolls can be scrolled with keys, too.
  document.querySelectorAll("main pre > code, .table-wrapper, .katex-display").forEach((box) => (box.tabIndex = 0));
  // A corner of a table without a word heads nothing.
  document.querySelectorAll("main th:empty").forEach((cell) => cell.replaceWith(document.createElement("td")));
  // The generator's own bar: a landmark, with a button that keys reach.
  const bar = document.getElementById("mdbook-menu-bar");
  bar.setAttribute("role", "banner");
  const label = document.getElementById("mdbook-sidebar-toggle");
  const toggled = label.control;
  const toggle = make("button", { type: "button", id: label.id, className: label.className, title: label.title, ariaLabel: label.title }, ...label.childNodes);
  toggle.addEventListener("click", () => toggled.click());
  const tell = () => (toggle.ariaExpanded = toggled.checked);
  toggled.addEventListener("change", tell);
  tell();
  label.replaceWith(toggle);
  bar.querySelector(".right-buttons").prepend(make("a", { className: "playground", href: new URL("play/index.html", root), textContent: "Playground" }));
})();
