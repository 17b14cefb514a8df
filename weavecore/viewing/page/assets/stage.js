// The stage: camera, controls, and drawing when something has changed.

const canvas = byId("canvas");
const stageElement = byId("stage");
const FIELD = 32; // degrees

const stage = {
    renderer: null,
    scene: new THREE.Scene(),
    camera: new THREE.PerspectiveCamera(FIELD, 1, 0.1, 10),
    controls: null,
    beforeDrawing: [],
    isAsked: false,
    isFitted: false, // until the view is moved by hand
    radius: content.size / 2 || 1,

    /** Draw before the next frame; many askings make one drawing. */
    ask() {
        if (this.isAsked || !this.renderer) return;
        this.isAsked = true;
        requestAnimationFrame(() => {
            this.isAsked = false;
            this.draw();
        });
    },

    draw() {
        this.controls.update();
        this.setDepthRange();
        for (const task of this.beforeDrawing) task();
        this.renderer.render(this.scene, this.camera);
    },

    /** The nearer the far plane to the near one, the finer rods are told apart that nearly touch. */
    setDepthRange() {
        const distance = this.camera.position.length();
        this.camera.far = distance + 1.3 * this.radius;
        this.camera.near = Math.max(distance - 1.3 * this.radius, this.camera.far / 2000);
        this.camera.updateProjectionMatrix();
    },

    resize() {
        const { width, height } = stageElement.getBoundingClientRect();
        if (!width || !height || !this.renderer) return;
        this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / height;
        this.camera.updateProjectionMatrix();
        if (this.isFitted) this.fit();
        this.ask();
    },

    /** A test whether a ball of this middle and radius may be in the picture. */
    seer() {
        this.camera.updateMatrixWorld();
        const eye = this.camera.matrixWorldInverse.elements;
        const tall = Math.tan((FIELD * Math.PI) / 360), wide = tall * this.camera.aspect;
        const slantTall = Math.hypot(1, tall), slantWide = Math.hypot(1, wide);
        return ([x, y, z], radius) => {
            const depth = -(eye[2] * x + eye[6] * y + eye[10] * z + eye[14]);
            const across = Math.abs(eye[0] * x + eye[4] * y + eye[8] * z + eye[12]);
            const along = Math.abs(eye[1] * x + eye[5] * y + eye[9] * z + eye[13]);
            return across - depth * wide < radius * slantWide && along - depth * tall < radius * slantTall && depth > -radius;
        };
    },

    /** What a pixel measures at distance 1 from the eye. */
    pixelSize() {
        return (2 * Math.tan((FIELD * Math.PI) / 360)) / Math.max(canvas.clientHeight, 1);
    },

    /** Look from a direction, or from where the eye is, so that all points are in the picture; the view turns about their middle. */
    fit(direction = null, points = surface.vertices, margin = 0.9) {
        if (!this.renderer) return;
        this.stopMoving();
        const from = direction ? new THREE.Vector3(...direction) : this.camera.position.clone().sub(this.controls.target);
        from.normalize();
        const up = Math.abs(from.z) > 0.999 ? new THREE.Vector3(0, 1, 0) : new THREE.Vector3(0, 0, 1);
        const right = new THREE.Vector3().crossVectors(up, from).normalize();
        const above = new THREE.Vector3().crossVectors(from, right);
        const reach = this.reachFrom(from, right, above, points, margin);
        this.controls.target.copy(right.multiplyScalar(reach.x)).add(above.multiplyScalar(reach.y)).addScaledVector(from, reach.z);
        this.camera.position.copy(this.controls.target).addScaledVector(from, reach.distance - reach.z);
        this.isFitted = points === surface.vertices;
        this.ask();
    },

    /** End what is left of the last drag. */
    stopMoving() {
        const isDamped = this.controls.enableDamping;
        this.controls.enableDamping = false;
        this.controls.update();
        this.controls.enableDamping = isDamped;
    },

    /** Where the axis of the view must pass, how far away the eye must be for all points to be seen, and their middle depth. */
    reachFrom(from, right, above, points, margin) {
        const tall = Math.tan((FIELD * Math.PI) / 360) * margin, wide = tall * this.camera.aspect;
        const p = new THREE.Vector3();
        // Of each side of the view the point that is furthest out, as the intercept of a plane through the eye.
        let west = Infinity, east = -Infinity, south = Infinity, north = -Infinity, near = -Infinity, far = Infinity;
        for (let k = 0; k < points.length; k += 3) {
            p.set(points[k], points[k + 1], points[k + 2]);
            const x = p.dot(right), y = p.dot(above), z = p.dot(from);
            east = Math.max(east, x + z * wide);
            west = Math.min(west, x - z * wide);
            north = Math.max(north, y + z * tall);
            south = Math.min(south, y - z * tall);
            near = Math.max(near, z);
            far = Math.min(far, z);
        }
        const distance = Math.max((east - west) / 2 / wide, (north - south) / 2 / tall, near + 0.02 * this.radius);
        return { x: (east + west) / 2, y: (north + south) / 2, z: (near + far) / 2, distance };
    },

    /** Turn about the middle by angles in degrees. */
    turn(sideways, upwards) {
        this.isFitted = false;
        const offset = this.camera.position.clone().sub(this.controls.target);
        const distance = offset.length();
        let azimuth = Math.atan2(offset.y, offset.x) + (sideways * Math.PI) / 180;
        let height = Math.asin(offset.z / distance) + (upwards * Math.PI) / 180;
        height = Math.max(-1.55, Math.min(1.55, height));
        offset.set(Math.cos(height) * Math.cos(azimuth), Math.cos(height) * Math.sin(azimuth), Math.sin(height));
        this.camera.position.copy(this.controls.target).addScaledVector(offset, distance);
        this.ask();
    },

    /** Go nearer (below 1) or further away. */
    zoom(factor) {
        this.isFitted = false;
        const offset = this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor);
        this.camera.position.copy(this.controls.target).add(offset);
        this.ask();
    },

    /** Where a point of the model falls, in pixels of the canvas. */
    project(point) {
        const p = new THREE.Vector3(...point).project(this.camera);
        return [((p.x + 1) / 2) * canvas.clientWidth, ((1 - p.y) / 2) * canvas.clientHeight];
    },
};

/** Start drawing; false where the browser has no WebGL. */
function openStage() {
    try {
        stage.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    } catch {
        stageElement.append(make("p", { class: "message" }, "This browser shows no 3D pictures (WebGL); the figures and the rods are at hand all the same."));
        return false;
    }
    stage.renderer.setClearColor(0x000000, 0);
    stage.camera.up.set(0, 0, 1);
    stage.controls = new THREE.OrbitControls(stage.camera, canvas);
    stage.controls.enableDamping = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    stage.controls.dampingFactor = 0.12;
    stage.controls.zoomToCursor = true;
    stage.controls.addEventListener("change", () => stage.ask());
    stage.controls.addEventListener("start", () => (stage.isFitted = false));
    new ResizeObserver(() => stage.resize()).observe(stageElement);
    return true;
}
