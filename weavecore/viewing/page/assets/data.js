// The data of the page: packed arrays, and what is told of a rod.

function unpack(packed) {
    const text = atob(packed.data);
    const bytes = new Uint8Array(text.length);
    for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
    return new { Float32Array, Uint32Array, Uint8Array }[packed.type](bytes.buffer);
}

function unpackAll(object) {
    const result = {};
    for (const [key, value] of Object.entries(object)) {
        result[key] = value && typeof value === "object" && "data" in value ? unpack(value) : value;
    }
    return result;
}

const content = JSON.parse(document.getElementById("data").textContent);
const surface = unpackAll(content.surface);
const rods = unpackAll(content.rods);
const weave = content.weave && unpackAll(content.weave);
const equilibrium = content.equilibrium && unpackAll(content.equilibrium);
const sequence = content.sequence && unpackAll(content.sequence);
const nRods = rods.names.length;
const nGenerations = content.generationColours.length;

const FLOAT_MOST = 3.4e38; // What stands for infinity.

/** A length as a person reads it, with its unit. */
function lengthText(value, digits = 5) {
    if (value > FLOAT_MOST) return "straight";
    const text = new Intl.NumberFormat("en", { maximumSignificantDigits: digits }).format(value);
    return content.unit ? `${text} ${content.unit}` : text;
}

/** A station to at least a hundred-thousandth of the whole, without its unit: marks are set by it. */
function stationText(value, length) {
    const decimals = Math.max(0, Math.min(6, 5 - Math.ceil(Math.log10(Math.max(length, 1e-9)))));
    return value.toLocaleString("en", { minimumFractionDigits: decimals, maximumFractionDigits: decimals });
}

function percentText(value) {
    return `${Math.round(100 * value).toLocaleString("en")}%`;
}

/** The generations that a rod passes, rounded to whole ones. */
function generationsOf(rod) {
    const low = Math.round(rods.shallowest[rod]), high = Math.round(rods.deepest[rod]);
    return low === high ? `${low}` : `${low} to ${high}`;
}

/** For each rod its places in the joints' list of rods. */
const visitsOfRods = (() => {
    const lists = Array.from({ length: nRods }, () => []);
    if (weave) weave.jointRods.forEach((rod, place) => lists[rod].push(place));
    return lists;
})();

const jointOfVisit = (() => {
    if (!weave) return new Uint32Array(0);
    const owners = new Uint32Array(weave.jointRods.length);
    for (let j = 0; j + 1 < weave.jointOffsets.length; j++) owners.fill(j, weave.jointOffsets[j], weave.jointOffsets[j + 1]);
    return owners;
})();

/** The marks on a rod, by station: which other rod it meets there, at which joint, and whether it lies over it. */
function marksOf(rod) {
    const marks = [];
    for (const place of visitsOfRods[rod]) {
        const joint = jointOfVisit[place];
        for (let other = weave.jointOffsets[joint]; other < weave.jointOffsets[joint + 1]; other++) {
            if (other === place) continue;
            marks.push({ station: weave.jointStations[place], rod: weave.jointRods[other], joint, isOver: place > other });
        }
    }
    return marks.sort((a, b) => a.station - b.station || a.rod - b.rod);
}

/** The middle of a rod, or of one of its pieces, in the frame of the picture. */
function pointAlong(rod, part) {
    const first = rods.offsets[rod], last = rods.offsets[rod + 1] - 1;
    const station = part * rods.length[rod];
    let k = first;
    while (k < last - 1 && rods.stations[k + 1] < station) k++;
    const span = rods.stations[k + 1] - rods.stations[k];
    const t = span > 0 ? Math.min(Math.max((station - rods.stations[k]) / span, 0), 1) : 0;
    return [0, 1, 2].map((axis) => shownCoordinate(3 * k + axis) * (1 - t) + shownCoordinate(3 * (k + 1) + axis) * t);
}

/** An element with attributes, and texts or elements in it. */
function make(tag, attributes = {}, ...inside) {
    const element = tag.startsWith("svg:")
        ? document.createElementNS("http://www.w3.org/2000/svg", tag.slice(4))
        : document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
        if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
        else if (value === true) element.setAttribute(name, "");
        else if (value !== false && value !== null) element.setAttribute(name, value);
    }
    element.append(...inside);
    return element;
}

const byId = (id) => document.getElementById(id);
const cssColour = (colour) => `rgb(${colour.map(Math.round).join(" ")})`;
const mixColours = (a, b, part) => a.map((value, k) => value + (b[k] - value) * part);
