// What is shown: the state of the page, and how each rod is drawn by it.

const state = {
    picked: -1,
    hovered: -1,
    step: sequence ? nRods : 0,
    families: content.families.map(() => true),
    from: 0,
    to: nGenerations - 1,
    colourBy: "family",
    hasSurface: !equilibrium, // It would hide the rods that have moved behind it.
    atRest: equilibrium ? 1 : 0, // 0 as drawn, 1 at rest
    exaggeration: 1,
    marked: -1, // the joint under the pointer in the table of marks
};

const watchers = [];

/** Change the state; every part of the page then shows it. */
function change(changes) {
    Object.assign(state, changes);
    for (const watch of watchers) watch(changes);
    paint();
}

const stepOfRod = new Uint32Array(nRods);
if (sequence) sequence.rods.forEach((rod, k) => (stepOfRod[rod] = k));

const isComplete = () => !sequence || state.step >= nRods;

/** Whether a rod is there, by the switches and the step. */
function isShown(rod) {
    return state.families[rods.family[rod]] && (isComplete() || stepOfRod[rod] < state.step);
}

/** The colour of a rod by what is asked for, before others are dimmed for its sake. */
function colourOf(rod) {
    if (state.colourBy === "stress") return rampColour(content.utilisationColours, equilibrium.rodUtilisation[rod]);
    if (state.colourBy === "departure") return rampColour(content.utilisationColours, partOfLargest(equilibrium.rodMove[rod]));
    if (state.colourBy === "utilisation") return rampColour(content.utilisationColours, weave.utilisation[rod]);
    if (state.colourBy === "generation") {
        const middle = (rods.shallowest[rod] + rods.deepest[rod]) / 2;
        return rampColour(content.generationColours, nGenerations > 1 ? middle / (nGenerations - 1) : 0);
    }
    return content.families[rods.family[rod]].colour;
}

function rampColour(ramp, part) {
    const at = Math.min(Math.max(part, 0), 1) * (ramp.length - 1);
    const low = Math.min(Math.floor(at), ramp.length - 1);
    return mixColours(ramp[low], ramp[Math.min(low + 1, ramp.length - 1)], at - low);
}

let rodMesh = null, surfaceMesh = null, dots = null;
let dimmedColour = [255, 255, 255];
const dark = matchMedia("(prefers-color-scheme: dark)");

function openScene() {
    rodMesh = makeRods();
    surfaceMesh = makeSurface();
    dots = makeDots();
    stage.scene.add(surfaceMesh, rodMesh.mesh, dots);
    if (rodMesh.drawn) stage.scene.add(rodMesh.drawn.mesh);
    stage.beforeDrawing.push(() => {
        rodMesh.uniforms.pixel.value = stage.pixelSize();
        rodMesh.look(stage.pixelSize() * stage.camera.near);
        dots.material.uniforms.across.value = 11 * stage.renderer.getPixelRatio();
        flags.put();
    });
    dark.addEventListener("change", () => {
        setTheme();
        change({ colourBy: state.colourBy });
    });
    setTheme();
}

function setTheme() {
    const set = (uniform, name) => uniform.value.set(...pageColour(name).map((c) => c / 255));
    set(surfaceMesh.material.uniforms.outside, "--surface-outside");
    set(surfaceMesh.material.uniforms.inside, "--surface-inside");
    set(dots.material.uniforms.ground, "--panel");
    dimmedColour = pageColour("--dimmed");
    rodMesh.uniforms.dimmed.value.set(...dimmedColour.map((c) => c / 255));
    rodMesh.uniforms.ramp.value.forEach((colour, k) => colour.set(...litColour(content.utilisationColours[k]).map((c) => c / 255)));
    paint();
}

/** Put the state into the picture. */
function paint() {
    if (!rodMesh) return;
    const current = isComplete() ? -1 : state.step > 0 ? sequence.rods[state.step - 1] : -1;
    const focus = state.picked >= 0 ? state.picked : current;
    const near = new Set(state.picked >= 0 ? visibleNeighbours(state.picked) : []);
    for (let rod = 0; rod < nRods; rod++) {
        const isFocus = rod === focus || rod === state.hovered;
        const dimmed = focus >= 0 && !isFocus ? dimming(rod, near) : 0;
        const colour = fieldShown() ? [255 * dimmed, 0, 0] : mixColours(litColour(colourOf(rod)), dimmedColour, dimmed);
        const strength = !isShown(rod) ? HIDDEN : isFocus ? STRONG : PLAIN;
        rodMesh.colours.set([...colour.map(Math.round), strength], 4 * rod);
    }
    rodMesh.texture.needsUpdate = true;
    rodMesh.uniforms.amount.value = shownAmount();
    rodMesh.uniforms.field.value = fieldShown();
    const isWhole = state.from <= 0 && state.to >= nGenerations - 1;
    rodMesh.uniforms.depths.value = isWhole ? { x: -1e9, y: 1e9 } : { x: state.from - 0.04, y: state.to + 0.04 };
    surfaceMesh.visible = state.hasSurface;
    if (rodMesh.drawn) rodMesh.drawn.paint();
    setDots(dots, dotEntries(current));
    flags.set(flagEntries(current));
    stage.ask();
}

/** On a dark page deep colours are lifted, so that they stand out from it as they do from a light one. */
function litColour(colour) {
    if (!dark.matches) return colour;
    const [r, g, b] = colour;
    const brightness = (0.3 * r + 0.6 * g + 0.1 * b) / 255;
    return mixColours(colour, [255, 255, 255], Math.max(0, 1.6 * (0.55 - brightness)));
}

function dimming(rod, near) {
    if (state.picked < 0) return 0.3;
    return near.has(rod) ? 0.3 : 0.74;
}

function* visibleNeighbours(rod) {
    if (weave) for (const mark of marksOf(rod)) yield mark.rod;
}

function jointPlace(joint) {
    const moves = equilibrium ? equilibrium.jointMoves : null;
    return [0, 1, 2].map((axis) => weave.jointPoints[3 * joint + axis] + (moves ? shownAmount() * moves[3 * joint + axis] : 0));
}

/** The marks of the picked rod, or the joints that the step ties. */
function dotEntries(current) {
    if (!weave) return [];
    if (state.picked >= 0 && isShown(state.picked)) {
        const seen = new Map();
        for (const mark of marksOf(state.picked)) {
            if (!isShown(mark.rod)) continue;
            seen.set(mark.joint, { place: jointPlace(mark.joint), isFull: mark.isOver, colour: dotColour(mark.joint) });
        }
        return [...seen.values()];
    }
    if (current < 0) return supportEntries();
    const k = state.step - 1;
    return [...sequence.tied.subarray(sequence.tiedOffsets[k], sequence.tiedOffsets[k + 1])].map((joint) => ({
        place: jointPlace(joint),
        isFull: true,
        colour: pageColour("--accent"),
    }));
}

function dotColour(joint) {
    return pageColour(joint === state.marked ? "--alarm" : "--ink");
}

function flagEntries(current) {
    const rod = state.picked >= 0 ? state.picked : current;
    if (rod < 0 || !isShown(rod)) return [];
    const entries = [{ place: pointAlong(rod, 0), text: rods.names[rod], kind: "name" }];
    if (state.picked >= 0 && weave && weave.minRadius[rod] < FLOAT_MOST) {
        const place = equilibrium
            ? pointAlong(rod, weave.stationAtMin[rod] / rods.length[rod])
            : [...weave.pointAtMin.subarray(3 * rod, 3 * rod + 3)];
        entries.push({ place, text: `R ${lengthText(weave.minRadius[rod], 4)}`, kind: "radius" });
    }
    return entries;
}

/** The rod at a place of the canvas, in its pixels, or -1. */
const pickRod = (() => {
    const REACH = 8, side = 2 * REACH + 1;
    let target = null;
    const pixels = new Uint8Array(4 * side * side);
    return (x, y, reach = REACH) => {
        if (!stage.renderer) return -1;
        target = target || new THREE.WebGLRenderTarget(side, side);
        setPicking(true);
        stage.camera.setViewOffset(canvas.clientWidth, canvas.clientHeight, x - REACH - 0.5, y - REACH - 0.5, side, side);
        stage.renderer.setRenderTarget(target);
        stage.renderer.clear();
        stage.renderer.render(stage.scene, stage.camera);
        stage.renderer.readRenderTargetPixels(target, 0, 0, side, side, pixels);
        stage.renderer.setRenderTarget(null);
        stage.camera.clearViewOffset();
        setPicking(false);
        let best = -1, nearest = reach * reach + 1;
        for (let row = 0; row < side; row++) {
            for (let column = 0; column < side; column++) {
                const at = 4 * (row * side + column);
                const id = pixels[at] + 256 * pixels[at + 1] + 65536 * pixels[at + 2];
                const off = (row - REACH) ** 2 + (column - REACH) ** 2;
                if (id > 0 && off < nearest) [best, nearest] = [id - 1, off];
            }
        }
        return best;
    };
})();

function setPicking(isPicking) {
    rodMesh.uniforms.picking.value = isPicking;
    rodMesh.pick(isPicking);
    surfaceMesh.material.uniforms.picking.value = isPicking;
    if (rodMesh.drawn) rodMesh.drawn.mesh.visible = !isPicking && shownAmount() !== 0 && isComplete();
    dots.visible = !isPicking && dots.geometry.hasAttribute("position");
}
