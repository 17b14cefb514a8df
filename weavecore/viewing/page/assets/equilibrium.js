// A weave at rest: how far towards it the rods are shown, and the colours along them.

const EXAGGERATIONS = [1, 2, 5, 10, 20, 50, 100, 200];
const DRAWN_RADIUS = 0.4; // of the rods as drawn, in radii of the rods at rest
const FIELDS = { stress: 1, departure: 2 }; // Colourings that change along a rod, as the shader numbers them.

const fieldShown = () => FIELDS[state.colourBy] || 0;
const partOfLargest = (move) => (equilibrium.largestMove > 0 ? move / equilibrium.largestMove : 0);

/** How many times the departures are added to the drawn shape. */
const shownAmount = () => state.atRest * state.exaggeration;

/** A coordinate of a sample of the rods, where it is shown. */
const shownCoordinate = (k) => rods.points[k] + (equilibrium ? shownAmount() * equilibrium.moves[k] : 0);

function fillEquilibrium() {
    if (!equilibrium) return;
    byId("rest").hidden = false;
    byId("figures-part").before(byId("shown-part")); // The figures are long, and the slider is what the page is for.
    const slider = byId("at-rest"), scale = byId("exaggeration");
    scale.append(...EXAGGERATIONS.map((times) => make("option", { value: times }, times === 1 ? "true to scale" : `× ${times}`)));
    slider.addEventListener("input", () => change({ atRest: +slider.value / 100 }));
    for (const event of ["input", "change"]) scale.addEventListener(event, () => change({ exaggeration: +scale.value }));
    const show = () => {
        slider.value = Math.round(100 * state.atRest);
        scale.value = state.exaggeration;
        const part = state.atRest === 0 ? "as drawn" : state.atRest === 1 ? "at rest" : `${Math.round(100 * state.atRest)}% of the way to rest`;
        const times = state.exaggeration > 1 && state.atRest > 0 ? `, × ${state.exaggeration}` : "";
        byId("rest-text").textContent = part + times;
        slider.setAttribute("aria-valuetext", part);
    };
    watchers.push(show);
    show();
}

function equilibriumRodFigures(rod) {
    const force = equilibrium.rodForce[rod];
    const figures = [
        ["Stress at rest", `${equilibrium.rodStress[rod].toFixed(0)} MPa, ${percentText(equilibrium.rodUtilisation[rod])}`],
        ["Axial force", `${Math.abs(force).toPrecision(3)} N ${force < 0 ? "pushed" : "pulled"}`],
        ["Largest departure", lengthText(equilibrium.rodMove[rod], 3)],
    ];
    return figures;
}

/** The rods as drawn, thin and grey, beside those at rest. */
function makeDrawnRods(mesh, ribbons) {
    const colours = new Uint8Array(mesh.material.uniforms.rodColours.value.image.data.length);
    const { width, height } = mesh.material.uniforms.rodColours.value.image;
    const texture = new THREE.DataTexture(colours, width, height);
    const { vertexShader, fragmentShader, side, uniforms } = mesh.material;
    const own = { sides: 2, amount: 0, field: 0, radius: DRAWN_RADIUS * rods.radius, leastPixels: 0.5, rodColours: texture };
    const changed = Object.fromEntries(Object.entries(own).map(([name, value]) => [name, { value }]));
    const drawn = new THREE.Mesh(ribbons, new THREE.ShaderMaterial({ vertexShader, fragmentShader, side, uniforms: { ...uniforms, ...changed } }));
    drawn.frustumCulled = false;
    const paintDrawn = () => {
        for (let rod = 0; rod < nRods; rod++) colours.set([...dimmedColour, state.families[rods.family[rod]] ? PLAIN : HIDDEN], 4 * rod);
        texture.needsUpdate = true;
        drawn.visible = shownAmount() !== 0 && isComplete();
    };
    return { mesh: drawn, paint: paintDrawn };
}

/** A dot at each support. */
function supportEntries() {
    if (!equilibrium) return [];
    const entries = [];
    for (let k = 0; k < equilibrium.supports.length; k += 3) {
        entries.push({ place: [...equilibrium.supports.subarray(k, k + 3)], isFull: true, colour: pageColour("--accent") });
    }
    return entries;
}
