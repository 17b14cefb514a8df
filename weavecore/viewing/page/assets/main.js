// Putting it together: pointer, keys, the address, and the start.

function openTools() {
    byId("fit").addEventListener("click", () => stage.fit());
    byId("home").addEventListener("click", reset);
    byId("surface").addEventListener("click", () => change({ hasSurface: !state.hasSurface }));
    byId("help").addEventListener("click", () => byId("keys").showModal());
    watchers.push(() => byId("surface").setAttribute("aria-pressed", state.hasSurface));
}

function reset() {
    stopPlaying();
    stage.fit(content.view);
    change({
        picked: -1, hovered: -1, marked: -1, step: sequence ? nRods : 0, families: content.families.map(() => true),
        from: 0, to: nGenerations - 1, colourBy: "family", hasSurface: !equilibrium, atRest: equilibrium ? 1 : 0, exaggeration: 1,
    });
}

/** A click picks; a drag, which turns the view, does not. */
function openPointer() {
    const SLACK = 5;
    let down = null;
    canvas.addEventListener("pointerdown", (event) => {
        down = event.isPrimary && event.button === 0 ? [event.offsetX, event.offsetY] : null;
        hover(-1);
    });
    canvas.addEventListener("pointerup", (event) => {
        if (!down || Math.hypot(event.offsetX - down[0], event.offsetY - down[1]) > SLACK) return;
        down = null;
        pick(pickRod(event.offsetX, event.offsetY));
    });
    canvas.addEventListener("pointermove", (event) => event.pointerType === "mouse" && event.buttons === 0 && askHover(event));
    canvas.addEventListener("pointerleave", () => hover(-1));
}

let hoverAsked = 0, hoverCost = 0;
const MOST_HOVER_MS = 24;

/** Find what is under the pointer when it rests; where that takes long it is left to clicks. */
function askHover(event) {
    const [x, y] = [event.offsetX, event.offsetY];
    clearTimeout(hoverAsked);
    if (hoverCost > MOST_HOVER_MS) return;
    hoverAsked = setTimeout(() => {
        const start = performance.now();
        const rod = pickRod(x, y, 3);
        hoverCost = performance.now() - start;
        hover(rod, x, y);
    }, 40);
}

function hover(rod, x = 0, y = 0) {
    clearTimeout(hoverAsked);
    const tip = byId("tip");
    tip.hidden = rod < 0;
    if (rod >= 0) {
        tip.textContent = `${rods.names[rod]} · ${lengthText(rods.length[rod], 4)}`;
        tip.style.transform = `translate(${x + 14}px, ${y + 16}px)`;
    }
    canvas.classList.toggle("over-rod", rod >= 0);
    if (rod === state.hovered) return;
    state.hovered = rod;
    paint();
}

const KEYS = {
    ArrowLeft: () => goTo(state.step - 1),
    ArrowRight: () => goTo(state.step + 1),
    Home: () => goTo(0),
    End: () => goTo(nRods),
    " ": () => sequence && togglePlay(),
    "+": () => stage.zoom(0.85),
    "=": () => stage.zoom(0.85),
    "-": () => stage.zoom(1 / 0.85),
    "/": () => byId("find").focus(),
    "?": () => byId("keys").showModal(),
    f: () => stage.fit(),
    l: () => lookAt(state.picked),
    r: reset,
    s: () => change({ hasSurface: !state.hasSurface }),
    n: () => pick(neighbourInList(1)),
    p: () => pick(neighbourInList(-1)),
    Escape: () => pick(-1),
};
const TURNS = { ArrowLeft: [-10, 0], ArrowRight: [10, 0], ArrowUp: [0, 10], ArrowDown: [0, -10] };

function openKeys() {
    document.addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.metaKey || event.altKey || byId("keys").open) return;
        const inField = event.target.matches("input, select");
        if (inField && event.key === "Escape") return event.target.blur();
        if (inField || (event.target.matches("button") && [" ", "Enter"].includes(event.key))) return;
        const turn = event.shiftKey && TURNS[event.key];
        const act = turn ? () => stage.turn(...turn) : KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
        if (!act || (nRods === 0 && "np".includes(event.key.toLowerCase()))) return;
        event.preventDefault();
        act();
    });
}

/** The rod and the step stand in the address, so that a link shows them. */
function openAddress() {
    const read = () => {
        const asked = new URLSearchParams(location.hash.slice(1));
        const rod = rods.names.indexOf(asked.get("rod") || "");
        const step = parseInt(asked.get("step"), 10);
        if (sequence && step >= 0) goTo(step);
        if (rod >= 0) pick(rod);
    };
    let written = location.hash;
    watchers.push(() => {
        const parts = new URLSearchParams();
        if (state.picked >= 0) parts.set("rod", rods.names[state.picked]);
        if (!isComplete()) parts.set("step", state.step);
        const hash = parts.toString() ? `#${parts}` : "";
        if (hash === written || timer) return;
        written = hash;
        // Where a page may not change its address, as in some frames, it goes without.
        try {
            history.replaceState(null, "", hash || location.pathname + location.search);
        } catch {}
    });
    addEventListener("hashchange", read);
    read();
}

fillFigures();
fillColouring();
fillFamilies();
fillGenerations();
fillEquilibrium();
openDetails();
fillList(); // After the card, which takes room from the list.
openPlayer();
openTools();
openKeys();
if (openStage()) {
    openScene();
    openPointer();
    stage.resize();
    stage.fit(content.view);
}
openAddress();

/** What a program that looks at the page may ask: where a rod is on the canvas, what is picked, and what is drawn. */
window.weavecorePage = {
    placeOf: (name, part = 0.5) => stage.project(pointAlong(rods.names.indexOf(name), part)),
    rodAt: (x, y) => rods.names[pickRod(x, y)] || null,
    picture: () => {
        stage.draw();
        return canvas.toDataURL();
    },
    names: rods.names,
    get picked() {
        return rods.names[state.picked] || null;
    },
};
stage.ask();
requestAnimationFrame(() => requestAnimationFrame(() => document.documentElement.setAttribute("data-ready", "true")));
