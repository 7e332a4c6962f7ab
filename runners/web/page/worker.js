// Runs the library beside the page, one call after the other.
import start, * as library from "./fredholm_web.js";

const started = start();

// Whether the page has revoked the address that stands for "go on": a worker that computes hears no messages.
const isStopped = (address) => {
  const request = new XMLHttpRequest();
  request.open("GET", address, false);
  try {
    request.send();
    return false;
  } catch {
    return true;
  }
};

onmessage = async ({ data: { name, inputs, files, goOn } }) => {
  const progress = (walked, expected) => {
    postMessage({ walked, expected });
    return isStopped(goOn);
  };
  try {
    await started;
    library.put_files(Object.keys(files), Object.values(files));
    const takesProgress = name === "solve" || name === "field";
    const result = library[name](...inputs, ...(takesProgress ? [progress] : []));
    postMessage({ result });
  } catch (error) {
    postMessage({ error: error.message, isDefect: error instanceof WebAssembly.RuntimeError });
  }
};
