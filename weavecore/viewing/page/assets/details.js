// The card of the picked rod: its figures and its marks.

function pick(rod) {
    const changes = { picked: rod, marked: -1 };
    // What is picked must be seen.
    if (rod >= 0 && !state.families[rods.family[rod]]) {
        changes.families = state.families.map((isOn, family) => isOn || family === rods.family[rod]);
    }
    if (rod >= 0 && !isComplete() && stepOfRod[rod] >= state.step) changes.step = stepOfRod[rod] + 1;
    change(changes);
}

/** Bring the eye to a rod, from the side that it is on. */
function lookAt(rod) {
    if (rod < 0) return;
    stage.fit(null, rods.points.subarray(3 * rods.offsets[rod], 3 * rods.offsets[rod + 1]), 0.7);
}

function openDetails() {
    watchers.push((changes) => "picked" in changes && fillCard());
    watchers.push((changes) => {
        if ("picked" in changes) byId("said").textContent = state.picked < 0 ? "" : `${rods.names[state.picked]}, ${lengthText(rods.length[state.picked], 4)}`;
    });
    fillCard();
}

function fillCard() {
    const rod = state.picked, card = byId("card");
    card.hidden = rod < 0;
    if (rod < 0) return card.replaceChildren();
    const family = content.families[rods.family[rod]];
    const swatch = make("span", { class: "swatch large" });
    swatch.style.background = cssColour(litColour(family.colour));
    card.replaceChildren(
        make("header", {}, swatch, make("h2", {}, rods.names[rod]),
            make("button", { type: "button", class: "look", title: "Look at it (L)", onclick: () => lookAt(rod) }, "Look at it"),
            make("button", { type: "button", class: "close", "aria-label": "Let go of the rod", title: "Let go (Esc)", onclick: () => pick(-1) }, "×")),
        make("p", { class: "kind" }, `${family.name}, ${rods.closed[rod] ? "closed ring" : "open rod"}`),
        make("dl", { class: "figures" }, ...rodFigures(rod).map(([label, ...inside]) => make("div", {}, make("dt", {}, label), make("dd", {}, ...inside)))),
        ...(weave ? [useMeter(rod), ...markParts(rod)] : []),
    );
    card.scrollTop = 0;
}

function rodFigures(rod) {
    const figures = [["Length", lengthText(rods.length[rod], 6)]];
    if (nGenerations > 1) figures.push([generationsOf(rod).includes("to") ? "Generations" : "Generation", generationsOf(rod)]);
    if (sequence) figures.push(["Step", `${stepOfRod[rod] + 1} of ${nRods}`]);
    if (!weave) return figures;
    if (equilibrium) figures.push(...equilibriumRodFigures(rod));
    const radius = weave.minRadius[rod];
    figures.push(["Least radius", lengthText(radius, 5)]);
    if (radius < FLOAT_MOST) {
        figures.push(["at station", lengthText(weave.stationAtMin[rod], 5)]);
        figures.push(["Thickest for this bend", `Ø ${lengthText(weave.largestDiameter[rod], 3)}`]);
    }
    return figures;
}

function useMeter(rod) {
    const use = weave.utilisation[rod];
    const fill = make("div", { class: "meter-fill" });
    fill.style.width = `${Math.min(100, (100 * use) / 1.25)}%`;
    fill.style.background = cssColour(rampColour(content.utilisationColours, use));
    const text = use > 1 ? "bent too sharply" : `least radius allowed ${lengthText(weave.leastRadius[rod], 4)}`;
    return make("div", { class: use > 1 ? "meter alarm" : "meter" },
        make("p", {}, make("span", {}, "Utilisation"), make("strong", {}, percentText(use))),
        make("div", { class: "meter-bar", "aria-hidden": "true" }, fill, make("div", { class: "meter-limit" })),
        make("p", { class: "note" }, `${weave.material}: ${text}`));
}

function markParts(rod) {
    const marks = marksOf(rod);
    const body = make("tbody", {}, ...marks.map((mark) => markRow(rod, mark)));
    return [
        make("h3", {}, `Marks (${marks.length})`),
        stripOf(rod, marks),
        make("p", { class: "note" }, "Above the line: rods over it. Below: under it."),
        make("div", { class: "marks" }, make("table", {},
            make("thead", {}, make("tr", {}, ...["Station", "Other rod", "This lies"].map((text) => make("th", { scope: "col" }, text)))),
            body)),
    ];
}

function markRow(rod, mark) {
    const show = (joint) => () => change({ marked: joint });
    return make("tr", { onpointerenter: show(mark.joint), onpointerleave: show(-1), onfocusin: show(mark.joint) },
        make("td", {}, stationText(mark.station, rods.length[rod])),
        make("td", {}, make("button", { type: "button", class: "link", onclick: () => pick(mark.rod) }, rods.names[mark.rod])),
        make("td", {}, make("span", { class: mark.isOver ? "over" : "under" }, mark.isOver ? "over" : "under")));
}

/** The rod pulled straight, with what it lies over above the line and what it lies under below. */
function stripOf(rod, marks) {
    const WIDTH = 280, HEIGHT = 34, middle = HEIGHT / 2;
    const strip = make("svg:svg", { class: "strip", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": "The rod pulled straight, with its marks" });
    const at = (station) => (2 + (station / rods.length[rod]) * (WIDTH - 4)).toFixed(2);
    strip.append(make("svg:line", { class: "strip-rod", x1: 2, x2: WIDTH - 2, y1: middle, y2: middle }));
    for (const mark of marks) {
        const away = mark.isOver ? 1 : -1;
        const colour = cssColour(litColour(content.families[rods.family[mark.rod]].colour));
        strip.append(make("svg:line", { class: "strip-mark", stroke: colour, x1: at(mark.station), x2: at(mark.station), y1: middle + 12 * away, y2: middle + 5 * away }));
    }
    if (weave.minRadius[rod] < FLOAT_MOST) {
        const x = +at(weave.stationAtMin[rod]);
        strip.append(make("svg:path", { class: "strip-least", d: `M${x - 3.5} 1h7l-3.5 6z` }));
    }
    return strip;
}
