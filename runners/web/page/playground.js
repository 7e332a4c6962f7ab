// Three tabs, and the file in the address.
import { ofFragment } from "./share.js";
import { Equation } from "./equation.js";
import { Room } from "./room.js";
import { Scene } from "./scene.js";

const kinds = { equation: Equation, room: Room, scene: Scene };
const tabs = [...document.querySelectorAll('[role="tab"]')];
const opened = {};

const panelOf = (tab) => document.getElementById(tab.getAttribute("aria-controls"));

/** Shows a tab, with these files if there are some. */
const show = async (name, files) => {
  for (const tab of tabs) {
    const isShown = panelOf(tab).id === name;
    tab.setAttribute("aria-selected", isShown);
    tab.tabIndex = isShown ? 0 : -1;
    panelOf(tab).hidden = !isShown;
  }
  const isNew = !(name in opened);
  opened[name] ??= new kinds[name](document.getElementById(name));
  if (!files && !isNew) return;
  const own = opened[name];
  own.busy(true);
  try {
    await own.open(files);
  } catch (wrong) {
    own.busy(false);
    own.refuse(wrong.message);
  }
};

tabs.forEach((tab, i) => {
  tab.addEventListener("click", () => {
    history.replaceState(null, "", `#${panelOf(tab).id}`);
    show(panelOf(tab).id);
  });
  tab.addEventListener("keydown", ({ key }) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[key];
    if (!step) return;
    const next = tabs[(i + step + tabs.length) % tabs.length];
    next.focus();
    next.click();
  });
});

const fromAddress = async () => {
  const { tab, files } = await ofFragment(location.hash).catch(() => ({}));
  await show(tab in kinds ? tab : "equation", files);
};
addEventListener("hashchange", fromAddress);
fromAddress();
