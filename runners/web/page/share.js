// Files in the fragment of an address: deflated, in the letters of base64 that addresses may have.

const through = async (bytes, stream) =>
  new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());

/** The fragment of a tab with these texts of files, the problem file first. */
export const fragmentOf = async (tab, files) => {
  const bytes = new TextEncoder().encode(JSON.stringify(files));
  const packed = await through(bytes, new CompressionStream("deflate-raw"));
  const letters = Array.from(packed, (byte) => String.fromCharCode(byte)).join("");
  return `#${tab}=${btoa(letters).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "")}`;
};

/** The tab and the files of a fragment; of one without files the tab alone, and of none nothing. */
export const ofFragment = async (fragment) => {
  const [, tab, letters] = fragment.match(/^#(\w+)(?:=(.*))?$/) ?? [];
  if (!letters) return { tab };
  const packed = Uint8Array.from(atob(letters.replaceAll("-", "+").replaceAll("_", "/")), (letter) => letter.charCodeAt(0));
  const bytes = await through(packed, new DecompressionStream("deflate-raw"));
  return { tab, files: JSON.parse(new TextDecoder().decode(bytes)) };
};

/** Lets a browser save a text or bytes under this name. */
export const download = (name, content) => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content]));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
};
