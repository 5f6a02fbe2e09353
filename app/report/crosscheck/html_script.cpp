#include "app/report/crosscheck/html_parts.h"

namespace mray::app {

const char* const kPageScript = R"js(
"use strict";
// Half a second an image: slower than the three flashes a second that can do harm.
const FLICKER_MS = 500;

for (const figure of document.querySelectorAll("[data-compare]")) {
  const stage = figure.querySelector(".stage");
  const controls = figure.querySelector(".controls");
  const slider = figure.querySelector("input");
  const button = figure.querySelector("button");
  const shown = figure.querySelector(".shown");
  let timer = 0;
  const cut = () => {
    stage.style.setProperty("--cut", slider.value + "%");
    slider.setAttribute("aria-valuetext", slider.value + " % reference");
  };
  const stop = () => {
    clearInterval(timer);
    timer = 0;
    stage.classList.remove("whole", "none");
    button.setAttribute("aria-pressed", "false");
    shown.textContent = "";
  };
  const flick = () => {
    const whole = stage.classList.toggle("whole");
    stage.classList.toggle("none", !whole);
    shown.textContent = whole ? "variant" : "reference";
  };
  slider.addEventListener("input", () => { stop(); cut(); });
  button.addEventListener("click", () => {
    if (timer) return stop();
    button.setAttribute("aria-pressed", "true");
    flick();
    timer = setInterval(flick, FLICKER_MS);
  });
  cut();
  stage.classList.add("on");
  controls.hidden = false;
}

const said = document.getElementById("said");
for (const button of document.querySelectorAll("[data-copy]")) {
  button.hidden = false;
  button.addEventListener("click", async () => {
    const code = document.getElementById(button.dataset.copy);
    let copied = true;
    try {
      await navigator.clipboard.writeText(code.textContent);
    } catch {
      const range = document.createRange();
      range.selectNodeContents(code);
      getSelection().removeAllRanges();
      getSelection().addRange(range);
      copied = document.execCommand("copy");
    }
    said.textContent = copied ? "Command copied" : "Command selected; copy it with the keyboard";
    button.textContent = copied ? "Copied" : "Selected";
    setTimeout(() => { button.textContent = "Copy"; }, 1500);
  });
}
)js";

}  // namespace mray::app
