// The parts of three.js that the page uses; make_three.sh bundles them into three.js.
export {
    BufferAttribute,
    BufferGeometry,
    DataTexture,
    DoubleSide,
    FloatType,
    Mesh,
    PerspectiveCamera,
    Points,
    RGBAFormat,
    Scene,
    ShaderMaterial,
    Vector3,
    WebGLRenderTarget,
    WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
