// The rods as tubes: one small mesh, drawn once for every piece between two samples.

const STRIDE = 12; // place and depth; tangent and swelling; side and rod
const TEXTURE_WIDTH = 256;
const HIDDEN = 0, PLAIN = 128, STRONG = 255; // How a rod is drawn: the fourth part of its colour.

const ROD_VERTEX = `
    attribute vec4 startPlace, startAlong, startSide, endPlace, endAlong, endSide;
    uniform sampler2D rodColours;
    uniform float radius, leastPixels, pixel;
    varying vec3 vNormal;
    varying vec3 vColour;
    varying float vDepth;
    varying float vRound;
    flat varying int vRod;
    void main() {
        vRod = int(startSide.w + 0.5);
        vec4 tint = texelFetch(rodColours, ivec2(vRod % ${TEXTURE_WIDTH}, vRod / ${TEXTURE_WIDTH}), 0);
        if (startSide.w != endSide.w || tint.a < 0.1) {
            gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
            return;
        }
        vec4 place = mix(startPlace, endPlace, position.z);
        vec4 along = mix(startAlong, endAlong, position.z);
        vec3 tangent = normalize(along.xyz);
        vec3 side = mix(startSide.xyz, endSide.xyz, position.z);
        side = normalize(side - dot(side, tangent) * tangent);
        vec3 normal = normalMatrix * (position.x * side + position.y * cross(tangent, side));
        vec4 eye = modelViewMatrix * vec4(place.xyz, 1.0);
        float thick = tint.a > 0.9 ? 1.5 : 1.0;
        float across = pixel * -eye.z;
        eye.xyz += normal * max(radius, leastPixels * across) * thick * along.w;
        vRound = smoothstep(1.5, 4.0, radius / across);
        vNormal = normal;
        vColour = tint.rgb;
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
    const packed = new Float32Array(Math.max(count, 1) * STRIDE);
    let at = 0;
    for (let rod = 0; rod < nRods; rod++) {
        const first = rods.offsets[rod], n = rods.offsets[rod + 1] - first;
        let side = null;
        for (let k = -capped(rod); k < n + capped(rod); k++) {
            const inside = Math.min(Math.max(k, 0), n - 1);
            const beyond = k - inside;
            const tangent = tangentAt(first, n, inside, rods.closed[rod]);
            side = carriedSide(side, tangent);
            const reach = [0, 0.6, 1][Math.abs(beyond)] * Math.sign(beyond) * rods.radius;
            for (let axis = 0; axis < 3; axis++) {
                packed[at + axis] = rods.points[3 * (first + inside) + axis] + reach * tangent[axis];
                packed[at + 4 + axis] = tangent[axis];
                packed[at + 8 + axis] = side[axis];
            }
            packed[at + 3] = rods.depth[first + inside];
            packed[at + 7] = [1, 0.8, 0][Math.abs(beyond)];
            packed[at + 11] = rod;
            at += STRIDE;
        }
    }
    return { packed, count };
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

/** The mesh of all rods, and the texture that says how each is drawn. */
function makeRods() {
    const { packed, count } = packSamples();
    const sides = count > 150000 ? 6 : count > 40000 ? 8 : 12;
    const geometry = new THREE.InstancedBufferGeometry();
    const around = new Float32Array(6 * sides), corners = [];
    for (let k = 0; k < sides; k++) {
        const turn = (2 * Math.PI * k) / sides, next = (k + 1) % sides;
        around.set([Math.cos(turn), Math.sin(turn), 0, Math.cos(turn), Math.sin(turn), 1], 6 * k);
        corners.push(2 * k, 2 * next, 2 * k + 1, 2 * k + 1, 2 * next, 2 * next + 1);
    }
    geometry.setAttribute("position", new THREE.BufferAttribute(around, 3));
    geometry.setIndex(corners);
    const samples = new THREE.InstancedInterleavedBuffer(packed, STRIDE);
    ["startPlace", "startAlong", "startSide", "endPlace", "endAlong", "endSide"].forEach((name, k) => {
        geometry.setAttribute(name, new THREE.InterleavedBufferAttribute(samples, 4, 4 * k));
    });
    geometry.instanceCount = Math.max(count - 1, 0);
    const height = Math.max(Math.ceil(nRods / TEXTURE_WIDTH), 1);
    const colours = new Uint8Array(4 * TEXTURE_WIDTH * height);
    const texture = new THREE.DataTexture(colours, TEXTURE_WIDTH, height);
    const material = new THREE.ShaderMaterial({
        vertexShader: ROD_VERTEX,
        fragmentShader: ROD_FRAGMENT,
        uniforms: {
            rodColours: { value: texture },
            radius: { value: rods.radius },
            leastPixels: { value: 0.9 },
            pixel: { value: 0 },
            depths: { value: { x: -1, y: 1e9 } },
            picking: { value: false },
        },
    });
    const mesh = new THREE.Mesh(geometry, material);
    mesh.frustumCulled = false;
    return { mesh, colours, texture, uniforms: material.uniforms };
}
