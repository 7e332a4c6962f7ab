// What all tabs have: fields with their errors, actions, a line that says what is going on, and the printed text.
import { download, fragmentOf } from "./share.js";

/** A number as a file says it. */
export const number = (text) => {
  const value = Number(String(text).trim() || "?");
  return Number.isFinite(value) ? value : undefined;
};

export class Tab {
  solver = new globalThis.fredholm.Solver();

  constructor(panel, kind) {
    this.panel = panel;
    this.kind = kind;
    const button = (text, action) => {
      const made = document.createElement("button");
      made.type = "button";
      made.textContent = text;
      made.addEventListener("click", () => action(made));
      panel.querySelector(".actions").append(made);
      return made;
    };
    this.stopButton = button("Stop", () => this.stop());
    this.busy(false);
    button("Share", () => this.share());
    button("Download the problem file", () => {
      for (const [name, text] of Object.entries(this.files())) download(name, text);
    });
    panel.querySelector("form")?.addEventListener("submit", (event) => event.preventDefault());
  }

  field(name) {
    return this.panel.querySelector(`[name="${name}"]`);
  }

  plot(name) {
    return this.panel.querySelector(`[data-plot="${name}"]`);
  }

  say(text) {
    this.panel.querySelector(".status").textContent = text;
  }

  output(name, text) {
    this.panel.querySelector(`[data-value="${name}"]`).textContent = text;
  }

  print(answer) {
    this.panel.querySelector(".printed").textContent = [...answer.said, answer.table].join("\n");
  }

  /** Whether something is computed, which can be stopped. */
  busy(isBusy) {
    this.panel.setAttribute("aria-busy", isBusy);
    this.stopButton.disabled = !isBusy;
    if (isBusy) this.isStopped = false;
  }

  /** Shows an error beside a field, or in the line below all if there is none. */
  refuse(message, name) {
    const field = name && this.field(name);
    if (!field) {
      const status = this.panel.querySelector(".status");
      status.textContent = message;
      status.classList.add("wrong");
      return;
    }
    const told = document.createElement("span");
    told.className = "wrong";
    told.id = `${this.kind}-${name}-wrong`;
    told.role = "alert";
    told.textContent = message;
    field.setAttribute("aria-invalid", "true");
    field.setAttribute("aria-describedby", told.id);
    field.after(told);
  }

  /** Takes back all errors. */
  accept() {
    this.panel.querySelector(".status").classList.remove("wrong");
    this.panel.querySelectorAll("span.wrong").forEach((told) => told.remove());
    this.panel.querySelectorAll("[aria-invalid]").forEach((field) => {
      field.removeAttribute("aria-invalid");
      field.removeAttribute("aria-describedby");
    });
  }

  /** The number of a field within these ends; nothing, and an error beside it, if it is none. */
  numberOf(name, [least, most], isWhole = false) {
    const value = number(this.field(name).value);
    if (value >= least && value <= most && !(isWhole && value % 1)) return value;
    const what = isWhole ? "a whole number" : "a number";
    this.refuse(`${this.field(name).value || "nothing"}: it must be ${what} from ${least} to ${most}`, name);
    return undefined;
  }

  progress = (walked, expected) => {
    const share = expected > 0 ? `${Math.min(100, Math.round((100 * walked) / expected))} % of the walks` : `${walked} walks`;
    this.say(walked > 0 ? share : "setting up");
  };

  async share() {
    const fragment = await fragmentOf(this.kind, this.files());
    history.replaceState(null, "", fragment);
    try {
      await navigator.clipboard.writeText(location.href);
      this.say(`The address has the problem in it (${location.href.length} letters), and is copied.`);
    } catch {
      this.say(`The address has the problem in it (${location.href.length} letters): copy it from above.`);
    }
  }

  stop() {
    this.isStopped = true;
    this.solver.stop();
  }
}

/** Calls `work` once nothing has asked for it for so many milliseconds. */
export const afterwards = (milliseconds, work) => {
  let timer;
  return () => {
    clearTimeout(timer);
    timer = setTimeout(work, milliseconds);
  };
};
