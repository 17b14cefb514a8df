// The rods as tubes.  Their samples lie in a texture, and each corner of the mesh finds by its number the sample and the side
// that it belongs to: so a rod costs little memory, and nothing is written when it changes its looks.  Where rods are too thin to
// look round, and where they are only searched for what is picked, they are ribbons, which take a fraction of the time; and where
// the whole is seen, ribbons skip the samples without which they stay within a pixel. What lies outside of the picture is not drawn.

const SAMPLES_A_ROW = 680, RODS_A_ROW = 256; // in the textures
const FIELD_COLOURS = 24; // of a scale that changes along a rod
const STRIDE = 12; // place and depth; tangent and swelling; side and rod
const ROUND_PIXELS = [1.5, 4.0]; // From which radius on a rod begins to look round, and does.
const FAR_TOLERANCE = 1 / 1500; // How far ribbons seen from afar may leave their samples, in radii of the whole.
const SEGMENTS_A_CHUNK = 32; // that are in the picture or not together
const HIDDEN = 0, PLAIN = 128, STRONG = 255; // How a rod is drawn: the fourth part of its colour.

const ROD_VERTEX = `
    uniform highp sampler2D samples, moves;
    uniform sampler2D rodColours;
    uniform int sides, field;
    uniform float amount, largestMove;
    uniform vec3 ramp[${FIELD_COLOURS}];
    uniform vec3 dimmed;
    uniform float radius, leastPixels, pixel;
    varying vec3 vNormal;
    varying vec3 vColour;
    varying float vDepth;
    varying float vRound;
    flat varying int vRod;
    ivec2 texelOf(int k) {
        return ivec2(3 * (k % ${SAMPLES_A_ROW}), k / ${SAMPLES_A_ROW});
    }
    vec4 moveOf(int k) {
        return texelFetch(moves, ivec2(k % ${SAMPLES_A_ROW}, k / ${SAMPLES_A_ROW}), 0);
    }
    // Where sample k is shown; that of another rod counts as the one it is asked for.
    vec3 shownAt(int k, int instead, int rod) {
        if (k < 0 || int(texelFetch(samples, texelOf(k) + ivec2(2, 0), 0).w + 0.5) != rod) k = instead;
        return texelFetch(samples, texelOf(k), 0).xyz + amount * moveOf(k).xyz;
    }
    vec3 rampColour(float part) {
        float at = clamp(part, 0.0, 1.0) * float(${FIELD_COLOURS} - 1);
        int low = min(int(at), ${FIELD_COLOURS} - 2);
        return mix(ramp[low], ramp[low + 1], at - float(low));
    }
    void main() {
        int k = gl_VertexID / sides;
        ivec2 at = texelOf(k);
        vec4 place = texelFetch(samples, at, 0);
        vec4 along = texelFetch(samples, at + ivec2(1, 0), 0);
        vec4 side = texelFetch(samples, at + ivec2(2, 0), 0);
        vRod = int(side.w + 0.5);
        vec4 tint = texelFetch(rodColours, ivec2(vRod % ${RODS_A_ROW}, vRod / ${RODS_A_ROW}), 0);
        if (tint.a < 0.1) {
            gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
            return;
        }
        if (amount != 0.0) {
            place.xyz += amount * moveOf(k).xyz;
            vec3 direction = shownAt(k + 1, k, vRod) - shownAt(k - 1, k, vRod);
            along.xyz = direction / max(length(direction), 1e-20);
            vec3 across = side.xyz - dot(side.xyz, along.xyz) * along.xyz;
            side.xyz = across / max(length(across), 1e-20);
        }
        vec4 eye = modelViewMatrix * vec4(place.xyz, 1.0);
        float turn = 6.2831853 * float(gl_VertexID % sides) / float(sides);
        vec3 normal = normalMatrix * (cos(turn) * side.xyz + sin(turn) * cross(along.xyz, side.xyz));
        if (sides == 2) {
            vec3 across = cross(normalMatrix * along.xyz, eye.xyz);
            normal = cos(turn) * across / max(length(across), 1e-20);
        }
        float thick = tint.a > 0.9 ? 1.5 : 1.0;
        float across = pixel * -eye.z;
        eye.xyz += normal * max(radius, leastPixels * across) * thick * along.w;
        vRound = smoothstep(${ROUND_PIXELS[0].toFixed(1)}, ${ROUND_PIXELS[1].toFixed(1)}, radius / across);
        vNormal = normal;
        vColour = tint.rgb;
        // Colours along a rod: its own texel then has how far it is dimmed.
        vec4 move = moveOf(k);
        if (field == 1) vColour = mix(rampColour(move.w), dimmed, tint.r);
        if (field == 2) vColour = mix(rampColour(length(move.xyz) / max(largestMove, 1e-20)), dimmed, tint.r);
        vDepth = place.w;
        gl_Position = projectionMatrix * eye;
    }`;

const ROD_FRAGMENT = `
    uniform vec2 depths;
    uniform bool picking;
    varying vec3 vNormal;
    varying vec3 vColour;
    varying float vDepth;
    varying float vRound;
    flat varying int vRod;
    void main() {
        if (vDepth < depths.x || vDepth > depths.y) discard;
        if (picking) {
            int id = vRod + 1;
            gl_FragColor = vec4(float(id & 255), float((id >> 8) & 255), float(id >> 16), 255.0) / 255.0;
            return;
        }
        vec3 n = normalize(vNormal);
        float key = max(dot(n, vec3(-0.36, 0.62, 0.70)), 0.0);
        float gloss = pow(max(dot(n, vec3(-0.22, 0.42, 0.88)), 0.0), 36.0);
        float edge = mix(0.62, 1.0, smoothstep(0.0, 0.5, n.z));
        // On a rod of few pixels light and shade would only flicker.
        vec3 flatColour = vColour * 0.88;
        vec3 roundColour = vColour * edge * (0.56 + 0.42 * key + 0.12 * n.y) + 0.16 * gloss;
        gl_FragColor = vec4(mix(flatColour, roundColour, vRound), 1.0);
    }`;

/** All samples in one array, each open end rounded by two more. */
function packSamples() {
    const capped = (rod) => (rods.closed[rod] ? 0 : 2);
    let count = 0;
    for (let rod = 0; rod < nRods; rod++) count += rods.offsets[rod + 1] - rods.offsets[rod] + 2 * capped(rod);
    const rowsOfSamples = Math.max(Math.ceil(count / SAMPLES_A_ROW), 1);
    const packed = new Float32Array(STRIDE * SAMPLES_A_ROW * rowsOfSamples);
    const moves = new Float32Array(4 * (equilibrium ? SAMPLES_A_ROW * rowsOfSamples : 1));
    let at = 0;
    for (let rod = 0; rod < nRods; rod++) {
        const first = rods.offsets[rod], n = rods.offsets[rod + 1] - first;
        let side = null;
        for (let k = -capped(rod); k < n + capped(rod); k++) {
            const inside = Math.min(Math.max(k, 0), n - 1);
            const beyond = k - inside;
            const tangent = tangentAt(first, n, inside, rods.closed[rod]);
            side = carriedSide(side, tangent);
            const reach = [0, 0.6, 1][Math.abs(beyond)] * Math.sign(beyond) * rods.radius * rods.thickness[rod];
            for (let axis = 0; axis < 3; axis++) {
                packed[at + axis] = rods.points[3 * (first + inside) + axis] + reach * tangent[axis];
                packed[at + 4 + axis] = tangent[axis];
                packed[at + 8 + axis] = side[axis];
            }
            packed[at + 3] = rods.depth[first + inside];
            packed[at + 7] = [1, 0.8, 0][Math.abs(beyond)] * rods.thickness[rod];
            packed[at + 11] = rod;
            if (equilibrium) {
                moves.set(equilibrium.moves.subarray(3 * (first + inside), 3 * (first + inside) + 3), (4 * at) / STRIDE);
                moves[(4 * at) / STRIDE + 3] = equilibrium.utilisation[first + inside];
            }
            at += STRIDE;
        }
    }
    return { packed, count, moves };
}

/** The direction of a curve at sample k of n; a closed one has its first sample at its end again. */
function tangentAt(first, n, k, isClosed) {
    const before = k > 0 ? k - 1 : isClosed ? n - 2 : 0;
    const after = k < n - 1 ? k + 1 : isClosed ? 1 : n - 1;
    const tangent = [0, 1, 2].map((axis) => rods.points[3 * (first + after) + axis] - rods.points[3 * (first + before) + axis]);
    return unit(tangent) || [1, 0, 0];
}

/** A direction across the tangent that turns as little as can be from the one before. */
function carriedSide(side, tangent) {
    const least = tangent.map(Math.abs).indexOf(Math.min(...tangent.map(Math.abs)));
    const spare = [0, 1, 2].map((axis) => (axis === least ? 1 : 0));
    for (const from of side ? [side, spare] : [spare]) {
        const along = from[0] * tangent[0] + from[1] * tangent[1] + from[2] * tangent[2];
        const across = unit(from.map((value, axis) => value - along * tangent[axis]));
        if (across) return across;
    }
    return spare;
}

function unit(vector) {
    const size = Math.hypot(...vector);
    return size > 1e-20 ? vector.map((value) => value / size) : null;
}

/** Every sample of the array. */
function allSamples(count) {
    return Uint32Array.from({ length: count }, (_, k) => k);
}

/** The samples that are needed for ribbons to stay within a tolerance: from each on, the furthest that all between are near to. */
function fewSamples(packed, count, tolerance) {
    const kept = [];
    for (let from = 0; from < count; ) {
        kept.push(from);
        let to = from + 1;
        while (to < count && isNearChord(packed, from, to, tolerance)) to += 1;
        from = to > from + 1 ? to - 1 : to;
    }
    return Uint32Array.from(kept);
}

/** Whether one rod goes from a sample to a later one with all between them within a tolerance of the chord. */
function isNearChord(packed, from, to, tolerance) {
    const a = STRIDE * from, b = STRIDE * to;
    if (packed[a + 11] !== packed[b + 11] || to - from > SEGMENTS_A_CHUNK) return false;
    const chord = [0, 1, 2].map((axis) => packed[b + axis] - packed[a + axis]);
    const square = Math.max(chord[0] ** 2 + chord[1] ** 2 + chord[2] ** 2, 1e-20);
    for (let k = a + STRIDE; k < b; k += STRIDE) {
        const x = packed[k] - packed[a], y = packed[k + 1] - packed[a + 1], z = packed[k + 2] - packed[a + 2];
        const part = Math.min(Math.max((x * chord[0] + y * chord[1] + z * chord[2]) / square, 0), 1);
        if (Math.hypot(x - part * chord[0], y - part * chord[1], z - part * chord[2]) > tolerance) return false;
        if (packed[k + 7] !== packed[a + 7]) return false; // The rounded ends stay.
    }
    return true;
}

/** Tubes of so many sides, or with 2 ribbons that face the eye, through some samples: the mesh, and its pieces with their bounds. */
function makeDetail(packed, kept, sides) {
    const around = sides === 2 ? 1 : sides;
    const corners = new Uint32Array(6 * around * Math.max(kept.length - 1, 0));
    const chunks = [];
    let at = 0, chunk = null;
    for (let k = 0; k + 1 < kept.length; k++) {
        const from = kept[k], to = kept[k + 1];
        const rod = packed[STRIDE * from + 11];
        if (rod !== packed[STRIDE * to + 11]) continue;
        if (!chunk || chunk.rod !== rod || chunk.segments === SEGMENTS_A_CHUNK) {
            chunk = { rod, segments: 0, start: at, stop: at, low: [1e30, 1e30, 1e30], high: [-1e30, -1e30, -1e30] };
            chunks.push(chunk);
        }
        for (const sample of [from, to]) {
            for (let axis = 0; axis < 3; axis++) {
                chunk.low[axis] = Math.min(chunk.low[axis], packed[STRIDE * sample + axis]);
                chunk.high[axis] = Math.max(chunk.high[axis], packed[STRIDE * sample + axis]);
            }
        }
        for (let side = 0; side < around; side++) {
            const next = (side + 1) % sides;
            const a = sides * from + side, b = sides * from + next, c = sides * to + side, d = sides * to + next;
            corners.set([a, b, c, c, b, d], at);
            at += 6;
        }
        chunk.segments += 1;
        chunk.stop = at;
    }
    for (const one of chunks) {
        one.middle = one.low.map((low, axis) => (low + one.high[axis]) / 2);
        one.reach = Math.hypot(...one.low.map((low, axis) => one.high[axis] - low)) / 2;
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setIndex(new THREE.BufferAttribute(corners.subarray(0, at), 1));
    return { geometry, sides, chunks };
}

/** Draw only the pieces of a mesh that may be seen, neighbours at once. */
function showChunks(detail, isSeen) {
    detail.geometry.clearGroups();
    let start = 0, stop = 0;
    for (const chunk of detail.chunks) {
        if (!isSeen(chunk.middle, chunk.reach)) continue;
        if (chunk.start !== stop) {
            if (stop > start) detail.geometry.addGroup(start, stop - start, 0);
            start = chunk.start;
        }
        stop = chunk.stop;
    }
    if (stop > start) detail.geometry.addGroup(start, stop - start, 0);
}

/** The mesh of all rods, and the texture that says how each is drawn. */
function makeRods() {
    const { packed, count, moves } = packSamples();
    const samples = new THREE.DataTexture(packed, 3 * SAMPLES_A_ROW, packed.length / (STRIDE * SAMPLES_A_ROW), THREE.RGBAFormat, THREE.FloatType);
    samples.needsUpdate = true;
    const wide = equilibrium ? SAMPLES_A_ROW : 1;
    const moved = new THREE.DataTexture(moves, wide, moves.length / (4 * wide), THREE.RGBAFormat, THREE.FloatType);
    moved.needsUpdate = true;
    const sides = count > 150000 ? 6 : count > 40000 ? 8 : 12;
    const all = allSamples(count), tolerance = FAR_TOLERANCE * stage.radius;
    const tubes = makeDetail(packed, all, sides), ribbons = makeDetail(packed, all, 2);
    const farRibbons = makeDetail(packed, fewSamples(packed, count, tolerance), 2);
    const colours = new Uint8Array(4 * RODS_A_ROW * Math.max(Math.ceil(nRods / RODS_A_ROW), 1));
    const texture = new THREE.DataTexture(colours, RODS_A_ROW, colours.length / (4 * RODS_A_ROW));
    const material = new THREE.ShaderMaterial({
        vertexShader: ROD_VERTEX,
        fragmentShader: ROD_FRAGMENT,
        side: THREE.DoubleSide,
        uniforms: {
            samples: { value: samples },
            moves: { value: moved },
            amount: { value: 0 },
            field: { value: 0 },
            largestMove: { value: equilibrium ? equilibrium.largestMove : 1 },
            ramp: { value: content.utilisationColours.slice(0, FIELD_COLOURS).map(() => new THREE.Vector3()) },
            dimmed: { value: new THREE.Vector3() },
            rodColours: { value: texture },
            sides: { value: sides },
            radius: { value: rods.radius },
            leastPixels: { value: 0.9 },
            pixel: { value: 0 },
            depths: { value: { x: -1, y: 1e9 } },
            picking: { value: false },
        },
    });
    const { uniforms } = material;
    const mesh = new THREE.Mesh(tubes.geometry, material);
    mesh.frustumCulled = false;
    const drawn = equilibrium && makeDrawnRods(mesh, ribbons.geometry);
    mesh.material = [material]; // Only with a list are the groups of a mesh drawn.
    const show = (detail) => {
        mesh.geometry = detail.geometry;
        uniforms.sides.value = detail.sides;
    };
    let flat = ribbons, round = null; // The ribbons that fit the view, and what was shown before a search.
    /** Choose how finely the rods are drawn, by the least size of a pixel on them, and which of them are in the picture. */
    const look = (pixel) => {
        // What changes along a rod, and where it is cut, shows at its samples.
        const isPlain = uniforms.amount.value === 0 && uniforms.field.value === 0 && state.from <= 0 && state.to >= nGenerations - 1;
        const isFlat = rods.radius / pixel < ROUND_PIXELS[0];
        const detail = !isFlat ? tubes : isPlain && tolerance < pixel ? farRibbons : ribbons;
        const room = Math.max(1.5 * rods.radius, 2 * pixel) + (equilibrium ? uniforms.amount.value * equilibrium.largestMove : 0);
        const isSeen = stage.seer();
        for (const one of isFlat ? [detail] : [tubes, ribbons]) showChunks(one, (middle, reach) => isSeen(middle, reach + room));
        show(detail);
        flat = isFlat ? detail : ribbons;
    };
    /** Draw ribbons while it is searched for what is picked. */
    const pick = (isPicking) => {
        if (isPicking) round = mesh.geometry === tubes.geometry ? tubes : flat;
        show(isPicking ? flat : round);
    };
    return { mesh, colours, texture, uniforms, look, pick, drawn };
}
