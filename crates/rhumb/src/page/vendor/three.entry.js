export {
  BoxGeometry, BufferAttribute, BufferGeometry, Color, ColorManagement, ConeGeometry, CylinderGeometry,
  DataTexture, DoubleSide, FloatType, GLSL3, Group, LineBasicMaterial,
  LineSegments, LinearSRGBColorSpace, Matrix4, Mesh, PerspectiveCamera, Points,
  RawShaderMaterial, RGBAFormat, Scene, UnsignedByteType, Vector3,
  WebGLRenderer, WebGLRenderTarget,
} from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
