// What stands about the rods: the surface that was woven, dots at joints, and flags with words.

const SURFACE_VERTEX = `
    uniform float setBack;
    varying vec3 vNormal;
    varying vec3 vEye;
    void main() {
        vec4 eye = modelViewMatrix * vec4(position, 1.0);
        vNormal = normalMatrix * normal;
        vEye = eye.xyz;
        gl_Position = projectionMatrix * eye;
        // Rods lie on both sides of the surface; it is set back so that those on its far side are seen too.
        vec3 ray = normalize(eye.xyz);
        float slant = max(abs(dot(ray, normalize(vNormal))), 0.25);
        vec4 behind = projectionMatrix * vec4(eye.xyz + ray * setBack / slant, 1.0);
        gl_Position.z = behind.z / behind.w * gl_Position.w;
    }`;

const SURFACE_FRAGMENT = `
    uniform vec3 outside, inside;
    uniform bool picking;
    varying vec3 vNormal;
    varying vec3 vEye;
    void main() {
        if (picking) {
            gl_FragColor = vec4(0.0, 0.0, 0.0, 1.0);
            return;
        }
        vec3 n = normalize(vNormal);
        bool shows_outside = dot(n, vEye) < 0.0;
        if (!shows_outside) n = -n;
        float light = 0.66 + 0.30 * max(dot(n, vec3(-0.36, 0.62, 0.70)), 0.0) + 0.08 * n.y;
        light *= mix(0.86, 1.0, smoothstep(0.0, 0.4, n.z));
        gl_FragColor = vec4((shows_outside ? outside : inside) * light, 1.0);
    }`;

const DOT_VERTEX = `
    attribute vec4 tint;
    uniform float towards, across;
    varying vec4 vTint;
    void main() {
        vec4 eye = modelViewMatrix * vec4(position, 1.0);
        gl_Position = projectionMatrix * eye;
        // Joints lie within the rods: they are brought forward to be seen.
        vec4 nearer = projectionMatrix * vec4(eye.xyz - normalize(eye.xyz) * towards, 1.0);
        gl_Position.z = nearer.z / nearer.w * gl_Position.w;
        gl_PointSize = across;
        vTint = tint;
    }`;

const DOT_FRAGMENT = `
    uniform vec3 ground;
    uniform float across;
    varying vec4 vTint;
    void main() {
        float off = length(gl_PointCoord - 0.5) * across;
        float rim = across / 2.0 - 1.0;
        float cover = 1.0 - smoothstep(rim, rim + 1.0, off);
        if (cover < 0.02) discard;
        // A full dot for a rod on top, a ring for one beneath.
        float within = 1.0 - smoothstep(rim * 0.62 - 0.5, rim * 0.62 + 0.5, off);
        float isRing = step(vTint.a, 0.5);
        gl_FragColor = vec4(mix(vTint.rgb, ground, within * isRing), cover);
    }`;

function makeSurface() {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(surface.vertices, 3));
    geometry.setIndex(new THREE.BufferAttribute(surface.triangles, 1));
    geometry.computeVertexNormals();
    const material = new THREE.ShaderMaterial({
        vertexShader: SURFACE_VERTEX,
        fragmentShader: SURFACE_FRAGMENT,
        side: THREE.DoubleSide,
        uniforms: {
            setBack: { value: 6 * rods.radius },
            outside: { value: new THREE.Vector3() },
            inside: { value: new THREE.Vector3() },
            picking: { value: false },
        },
    });
    return new THREE.Mesh(geometry, material);
}

function makeDots() {
    const material = new THREE.ShaderMaterial({
        vertexShader: DOT_VERTEX,
        fragmentShader: DOT_FRAGMENT,
        transparent: true,
        uniforms: {
            towards: { value: 8 * rods.radius },
            across: { value: 10 },
            ground: { value: new THREE.Vector3(1, 1, 1) },
        },
    });
    const dots = new THREE.Points(new THREE.BufferGeometry(), material);
    dots.frustumCulled = false;
    dots.visible = false;
    return dots;
}

/** Show dots: places, colours from 0 to 255, and whether each is full. */
function setDots(dots, entries) {
    dots.geometry.dispose();
    dots.geometry = new THREE.BufferGeometry();
    dots.visible = entries.length > 0;
    if (!dots.visible) return;
    const places = new Float32Array(entries.flatMap((entry) => entry.place));
    const tints = new Float32Array(entries.flatMap((entry) => [...entry.colour.map((c) => c / 255), entry.isFull ? 1 : 0]));
    dots.geometry.setAttribute("position", new THREE.BufferAttribute(places, 3));
    dots.geometry.setAttribute("tint", new THREE.BufferAttribute(tints, 4));
}

/** Words at places of the model: they follow the view. */
const flags = {
    entries: [],

    set(entries) {
        this.entries = entries.map(({ place, text, kind }) => ({
            place,
            element: make("span", { class: `flag ${kind}` }, text),
        }));
        byId("flags").replaceChildren(...this.entries.map((entry) => entry.element));
    },

    put() {
        for (const { place, element } of this.entries) {
            const [x, y] = stage.project(place);
            element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
        }
    },
};

/** The colours of the page, as its style sheet has them for light and for dark. */
function pageColour(name) {
    const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    return [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16));
}
