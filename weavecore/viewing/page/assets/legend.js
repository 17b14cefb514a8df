// The figures, and the switches of what is shown: colours, families and generations.

function fillFigures() {
    byId("title").textContent = content.title;
    byId("stage-text").textContent = content.stage;
    for (const row of content.figures) {
        const value = row.rod === null
            ? row.text
            : make("button", { type: "button", class: "link", title: `Pick ${rods.names[row.rod]}`, onclick: () => pick(row.rod) },
                row.text, make("span", { class: "of" }, rods.names[row.rod]));
        byId("figures").append(make("div", { class: row.alarm ? "alarm" : null }, make("dt", {}, row.label), make("dd", {}, value)));
    }
}

const COLOURINGS = {
    family: { text: "Family", isFor: () => true },
    generation: { text: "Generation", isFor: () => nGenerations > 1 },
    utilisation: { text: "Utilisation", isFor: () => weave && !equilibrium },
    stress: { text: "Stress", isFor: () => equilibrium },
    departure: { text: "Departure", isFor: () => equilibrium },
};

/** Of a colouring by a scale: its colours, and what stands at its two ends. */
const RAMPS = {
    generation: () => [content.generationColours, "border", `generation ${nGenerations - 1}`],
    utilisation: () => [content.utilisationColours, "straight", "100% or more: too sharp"],
    stress: () => [content.utilisationColours, "0 MPa", `${equilibrium.allowableStress.toFixed(0)} MPa: allowable`],
    departure: () => [content.utilisationColours, lengthText(0), lengthText(equilibrium.largestMove, 3)],
};

function fillColouring() {
    const names = Object.keys(COLOURINGS).filter((name) => COLOURINGS[name].isFor());
    if (names.length < 2) {
        byId("colour-by").hidden = true;
        return;
    }
    byId("colour-by").classList.toggle("in-rows", names.length > 3);
    for (const name of names) {
        const input = make("input", { type: "radio", name: "colour-by", value: name, checked: name === state.colourBy, onchange: () => change({ colourBy: name }) });
        byId("colour-by").append(make("label", {}, input, make("span", {}, COLOURINGS[name].text)));
    }
    watchers.push(showRamp);
}

function showRamp() {
    for (const input of byId("colour-by").querySelectorAll("input")) input.checked = input.value === state.colourBy;
    byId("ramp").hidden = state.colourBy === "family";
    if (state.colourBy === "family") return;
    const [colours, low, high] = RAMPS[state.colourBy]();
    byId("ramp-bar").style.background = colours.length > 1 ? `linear-gradient(to right, ${colours.map(cssColour)})` : cssColour(colours[0]);
    byId("ramp-low").textContent = low;
    byId("ramp-high").textContent = high;
}

function fillFamilies() {
    const counts = content.families.map((_, family) => rods.family.filter((one) => one === family).length);
    content.families.forEach((family, k) => {
        if (!counts[k]) return;
        const box = make("input", { type: "checkbox", checked: true, value: k, onchange: () => {
            change({ families: state.families.map((isOn, other) => (other === k ? box.checked : isOn)) });
        } });
        const swatch = make("span", { class: "swatch" });
        byId("families").append(make("li", {}, make("label", {}, box, swatch, make("span", {}, family.name), make("span", { class: "count" }, String(counts[k])))));
        const show = () => {
            box.checked = state.families[k];
            swatch.style.background = cssColour(litColour(family.colour));
        };
        watchers.push(show);
        show();
    });
}

function fillGenerations() {
    if (nGenerations < 2) return;
    byId("generations").hidden = false;
    const from = byId("from"), to = byId("to");
    from.max = to.max = nGenerations - 1;
    from.addEventListener("input", () => change({ from: Math.min(+from.value, state.to) }));
    to.addEventListener("input", () => change({ to: Math.max(+to.value, state.from) }));
    const show = () => {
        from.value = state.from;
        to.value = state.to;
        // With both at the end only the lower one can be moved: it must lie on top.
        from.classList.toggle("on-top", state.from > (nGenerations - 1) / 2);
        const part = (value) => `${(100 * value) / (nGenerations - 1)}%`;
        byId("double-fill").style.left = part(state.from);
        byId("double-fill").style.right = part(nGenerations - 1 - state.to);
        byId("generations-text").textContent = state.from === state.to ? `${state.from}` : `${state.from} to ${state.to}`;
    };
    watchers.push(show);
    show();
}
