// What viser leaves out for keyboards and screen readers: names of sliders and fields, folders that open by key. Runs
// once, for the whole page. PANIC is also sent by viser's way of keys: a button's click waits behind other controls'
// messages for up to 50 ms, and is lost when one of them follows within that time. And without a beat from the panel
// the page says so: viser only dims what it shows, and a link that hangs it does not notice at all.
((style) => {
  if (document.body.dataset.drumstick) return;
  document.body.dataset.drumstick = "ready";
  document.title = style.dataset.title;
  const put = (part, name, value) => {
    if (value && part.getAttribute(name) !== value) part.setAttribute(name, value);
  };
  const spoken = (slider, control) => {
    const at = Number(slider.getAttribute("aria-valuenow"));
    const value = control.dataset.scale === "log" ? Number((10 ** at).toPrecision(3)) : at;
    return `${value} ${control.dataset.unit}`.trim();
  };
  const nameSliders = () => {
    let control = null;
    for (const part of document.querySelectorAll("[data-param], [role=slider]")) {
      if (part.dataset.param) control = part;
      else if (control) {
        put(part, "aria-label", control.dataset.label);
        put(part, "aria-description", control.dataset.hint);
        put(part, "aria-valuetext", spoken(part, control));
      }
    }
  };
  const nameFields = () => {
    for (const label of document.querySelectorAll("label[for]")) {
      const field = label.closest("[class*=Flex-root]")?.querySelector("input[type=text], input:not([type])");
      if (field && !field.closest("[class*=NumberInput]")) put(field, "aria-label", label.textContent);
    }
  };
  const openByKey = (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    event.currentTarget.click();
  };
  const nameFolders = () => {
    for (const icon of document.querySelectorAll(".tabler-icon-chevron-down, .tabler-icon-chevron-up")) {
      const head = icon.parentElement;
      if (!head.className.includes("Paper-root")) continue;
      if (!head.hasAttribute("tabindex")) head.addEventListener("keydown", openByKey);
      put(head, "tabindex", "0");
      put(head, "role", "button");
      put(head, "aria-expanded", String(icon.classList.contains("tabler-icon-chevron-up")));
    }
  };
  // One main part, which holds all; pictures have names, and what only covers them is none.
  const namePictures = () => {
    put(document.getElementById("root"), "role", "main");
    for (const canvas of document.querySelectorAll("canvas[data-engine]")) {
      put(canvas, "role", "img");
      put(canvas, "aria-label", "Picture of the drum and the stick; its numbers are on this page");
    }
    for (const plot of document.querySelectorAll(".uplot")) {
      const title = plot.querySelector(".u-title")?.textContent;
      put(plot.querySelector(".u-wrap"), "role", "img");
      put(plot.querySelector(".u-wrap"), "aria-label", `Plot: ${title || "the chosen view"}`);
    }
  };
  const nameIcons = () => {
    const button = document.querySelector("button:has(.tabler-icon-list-search)");
    if (button) put(button, "aria-label", "Commands and their keys");
    for (const icon of document.querySelectorAll("svg:not([role])")) put(icon, "aria-hidden", "true");
  };
  const tickChosen = () => {
    for (const mark of document.querySelectorAll("[data-chosen]")) {
      const buttons = mark.parentElement.nextElementSibling?.querySelectorAll("button[data-size=compact-xs]") ?? [];
      for (const button of buttons) {
        put(button, "aria-pressed", String(mark.dataset.chosen.split("|").includes(button.textContent)));
      }
    }
  };
  // viser's tools for developers, and its small button that folds the page away with PANIC on it; not by the page's style sheet, which is away while viser connects anew.
  const hidden = document.createElement("style");
  hidden.textContent =
    "button:has(.tabler-icon-adjustments),.mantine-Stack-root:has(.tabler-icon-home-move)," +
    "[aria-label='Collapse panel area']{display:none !important}";
  document.head.append(hidden);
  // One live region, which stays: what viser writes anew as a whole, screen readers do not announce. Seconds that count
  // up are no news. Of the banner only what is bad is an alarm, or a PANIC that nobody has confirmed: Ready is none.
  const region = document.createElement("div");
  region.setAttribute("aria-live", "assertive");
  region.dataset.part = "spoken";
  region.style.cssText = "position:fixed;width:1px;height:1px;overflow:hidden;clip-path:inset(50%)";
  document.body.append(region);
  const ALARMS =
    "[data-part=cut-off], .dr-bad[data-part=notice], .dr-notice:not(.dr-bad) .dr-alarm, " +
    ".dr-alarm:not(.dr-fore *, .dr-notice *), .dr-refused";
  let told = new Set();
  const announce = () => {
    const texts = [...document.querySelectorAll(ALARMS)].map((part) => part.innerText || part.textContent);
    const news = texts.filter((text) => !told.has(text.replace(/\d+ s\b/g, "")));
    told = new Set(texts.map((text) => text.replace(/\d+ s\b/g, "")));
    if (news.length) region.textContent = news.join("\n");
    else if (!texts.length) region.textContent = ""; // which is not announced: who reads on finds no alarm that is over
  };
  // The panel puts picture and plots where the window has room for them. Told until it has heard it: viser drops a click
  // that comes with another one.
  const tellRoom = () => {
    const room = ["phone", "tablet", "wide"].find((each) => matchMedia(style.dataset[each]).matches) ?? "desk";
    const mark = document.querySelector("[data-room]");
    if (!mark || mark.dataset.room === room) return;
    const buttons = mark.parentElement.nextElementSibling?.querySelectorAll("button") ?? [];
    [...buttons].find((each) => each.textContent === room)?.click();
  };
  // A plot that gets its width and its data in one turn is left without the numbers of its axis, or without a scale.
  const widths = new WeakMap();
  const drawAxes = () => {
    for (const { chart } of Object.values(window.__viserTestpoints?.uplots ?? {})) {
      const x = chart.data[0];
      if (chart.scales.x.min == null && x.length) chart.setScale("x", { min: x[0], max: x[x.length - 1] });
      if (widths.get(chart) !== chart.width) chart.redraw(true, true);
      widths.set(chart, chart.width);
    }
  };
  // For the style of what opens over the page, and leaves PANIC free.
  const placePanic = () => {
    const box = document.querySelector("div:has(> .dr-panic) + div button")?.getBoundingClientRect();
    if (!box) return;
    for (const side of ["left", "top", "right", "bottom"]) {
      document.documentElement.style.setProperty(`--panic-${side}`, `${box[side]}px`);
    }
  };
  window.addEventListener("resize", placePanic);
  const nameAll = () => {
    announce();
    nameSliders();
    nameFields();
    nameFolders();
    nameIcons();
    namePictures();
    tickChosen();
  };
  let waits = false;
  const soon = () => {
    if (waits) return;
    waits = true;
    setTimeout(() => {
      waits = false;
      nameAll();
    }, 50);
  };
  new MutationObserver(soon).observe(document.body, {
    subtree: true,
    childList: true,
    attributes: true,
    attributeFilter: ["aria-valuenow"],
  });
  const panic = () => {
    const key = { key: "Escape", code: "Escape", bubbles: true };
    document.documentElement.dispatchEvent(new KeyboardEvent("keydown", key));
  };
  document.addEventListener(
    "click",
    (event) => {
      if (event.target.closest?.("div:has(> .dr-panic) + div button")) panic();
    },
    true,
  );
  // viser passes over keys in a field, so also while its palette or a list is open: ours comes before everybody's.
  window.addEventListener(
    "keydown",
    (event) => {
      if (event.isTrusted && event.key === "Escape" && !event.repeat) panic();
    },
    true,
  );
  // The key itself still closes what is open, but is not a second PANIC.
  document.body.addEventListener("keydown", (event) => {
    if (event.isTrusted && event.key === "Escape") event.stopPropagation();
  });
  const CUT_OFF = "No connection to the panel: what you see is old, and PANIC is not heard. Use the switch at the device.";
  const AGAIN = "To connect again, this window must have the focus: click into it.";
  const LOOK_MS = 500, MOST_MISSED = 6;
  // Styled here: when viser connects anew, all that the panel wrote is away for a while, and the styles with it.
  const strip = document.createElement("div");
  strip.style.cssText =
    "position:fixed;inset:0 0 auto;z-index:100000;padding:.6em 1em;background:#c8102e;color:#fff;font:600 1.5rem/1.25 " +
    "sans-serif;text-align:center;pointer-events:none";
  let beat = "", missed = 0;
  // viser takes no clicks from the moment that its connection has ended.
  const isDeaf = () => {
    const panicButton = document.querySelector("div:has(> .dr-panic) + div button");
    return panicButton !== null && getComputedStyle(panicButton).pointerEvents === "none";
  };
  // Looks are counted, and not seconds: in a hidden tab viser shows nothing, and a machine that slept has missed none.
  setInterval(() => {
    if (document.hidden) return;
    tellRoom();
    placePanic();
    drawAxes();
    // viser tells the shape of the picture when its box changes, but may read that of before, and then never again.
    window.__viserMutable?.sendCamera?.();
    const newest = document.querySelector("[data-beat]")?.dataset.beat ?? beat;
    missed = isDeaf() ? MOST_MISSED : newest === beat ? missed + 1 : 0;
    beat = newest;
    if (missed < MOST_MISSED) strip.remove();
    else if (!strip.isConnected) {
      strip.dataset.part = "cut-off";
      strip.innerText = `${CUT_OFF}\n${AGAIN}`;
      document.body.append(strip);
      announce();
    }
  }, LOOK_MS);
  nameAll();
})(this)
