// The rods as tubes.  Their samples lie in a texture, and each corner of the mesh finds by its number the sample and the side
// that it belongs to: so a rod costs little memory, and nothing is written when it changes its looks.  Where rods are too thin to
// look round, and where they are only searched for what is picked, they are ribbons, which take a fraction of the time.

const SAMPLES_A_ROW = 680, RODS_A_ROW = 256; // in the textures
const FIELD_COLOURS = 24; // of a scale that changes along a rod
const STRIDE = 12; // place and depth; tangent and swelling; side and rod
const ROUND_PIXELS = [1.5, 4.0]; // From which radius on a rod begins to look round, and does.
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

/** The corners of tubes of so many sides, or with 2 of flat ribbons that face the eye, between samples of the same rod. */
function tubeGeometry(packed, count, sides) {
    const around = sides === 2 ? 1 : sides;
    const corners = new Uint32Array(6 * around * Math.max(count - 1, 0));
    let at = 0;
    for (let k = 0; k + 1 < count; k++) {
        if (packed[STRIDE * k + 11] !== packed[STRIDE * (k + 1) + 11]) continue;
        for (let side = 0; side < around; side++) {
            const a = sides * k + side, b = sides * k + ((side + 1) % sides);
            corners.set([a, b, a + sides, a + sides, b, b + sides], at);
            at += 6;
        }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setIndex(new THREE.BufferAttribute(corners.subarray(0, at), 1));
    return geometry;
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
    const tubes = tubeGeometry(packed, count, sides), ribbons = tubeGeometry(packed, count, 2);
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
    const mesh = new THREE.Mesh(tubes, material);
    mesh.frustumCulled = false;
    const flatten = (isFlat) => {
        mesh.geometry = isFlat ? ribbons : tubes;
        material.uniforms.sides.value = isFlat ? 2 : sides;
    };
    return { mesh, colours, texture, uniforms: material.uniforms, flatten, drawn: equilibrium && makeDrawnRods(mesh, ribbons) };
}
