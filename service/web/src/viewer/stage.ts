// A mesh in three dimensions; two stages can share one camera.

import {
  AmbientLight,
  BufferAttribute,
  type BufferGeometry,
  Color,
  DirectionalLight,
  DoubleSide,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  Scene,
  SRGBColorSpace,
  Vector3,
  WebGLRenderer,
  WireframeGeometry,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { colourAt, type Range, type Scheme } from "./colours";

const PLAIN = "#b9c4c9";
const VIEW = new Vector3(0.5, 0.35, 1).normalize();
const MOST_PIXELS = 2;

export class Stage {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(35, 1, 0.01, 100);
  private readonly controls: OrbitControls;
  private readonly light = new DirectionalLight("#ffffff", 2.2);
  private readonly material = new MeshStandardMaterial({ color: PLAIN, roughness: 0.75, side: DoubleSide });
  private mesh: Mesh | null = null;
  private wire: LineSegments | null = null;
  private frame = 0;
  private readonly observer: ResizeObserver;
  private partner: Stage | null = null;

  constructor(canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.outputColorSpace = SRGBColorSpace;
    this.scene.add(new AmbientLight("#ffffff", 1.1), this.camera);
    this.camera.add(this.light);
    this.light.position.set(0.6, 1, 0.8);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enablePan = true;
    this.controls.addEventListener("change", () => {
      this.draw();
      this.partner?.follow(this);
    });
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(canvas);
    this.reset();
    this.resize();
  }

  /** Show the mesh of a GLB file, centred and at one size whatever its unit. */
  async load(glb: ArrayBuffer): Promise<void> {
    const found = await new GLTFLoader().parseAsync(glb, "");
    let geometry: BufferGeometry | null = null;
    found.scene.traverse((object) => {
      if (geometry === null && (object as Mesh).isMesh) geometry = (object as Mesh).geometry;
    });
    if (geometry === null) throw new Error("the file has no mesh");
    this.show(geometry);
  }

  private show(geometry: BufferGeometry): void {
    this.clear();
    geometry.computeBoundingBox();
    const box = geometry.boundingBox!;
    const centre = box.getCenter(new Vector3());
    geometry.translate(-centre.x, -centre.y, -centre.z);
    geometry.computeBoundingSphere();
    const scale = 1 / (geometry.boundingSphere!.radius || 1);
    geometry.scale(scale, scale, scale);
    if (!geometry.getAttribute("normal")) geometry.computeVertexNormals();
    this.mesh = new Mesh(geometry, this.material);
    this.scene.add(this.mesh);
    this.draw();
  }

  get vertexCount(): number {
    return this.mesh?.geometry.getAttribute("position").count ?? 0;
  }

  /** Paint a number at each vertex; null paints the surface plain. */
  paint(values: Float32Array | null, range: Range, scheme: Scheme): void {
    const geometry = this.mesh?.geometry;
    if (!geometry) return;
    const fits = values !== null && values.length === this.vertexCount;
    if (fits) {
      const colours = new Float32Array(3 * values.length);
      const colour = new Color();
      for (let i = 0; i < values.length; i++) {
        const share = (values[i]! - range.low) / (range.high - range.low);
        colour.setRGB(...colourAt(share, scheme), SRGBColorSpace).toArray(colours, 3 * i);
      }
      geometry.setAttribute("color", new BufferAttribute(colours, 3));
    }
    this.material.vertexColors = fits;
    this.material.color.set(fits ? "#ffffff" : PLAIN);
    this.material.needsUpdate = true;
    this.draw();
  }

  set wireframe(on: boolean) {
    if (on && this.mesh && !this.wire) {
      const material = new LineBasicMaterial({ color: "#10262b", transparent: true, opacity: 0.45 });
      this.wire = new LineSegments(new WireframeGeometry(this.mesh.geometry), material);
      this.scene.add(this.wire);
    }
    if (this.wire) this.wire.visible = on;
    this.draw();
  }

  /** Look from where everything is first seen from. */
  reset(): void {
    this.camera.position.copy(VIEW).multiplyScalar(3.6);
    this.controls.target.set(0, 0, 0);
    this.controls.update();
    this.draw();
    this.partner?.follow(this);
  }

  /** Turn by steps, as keys do: radians around the vertical and up. */
  turn(around: number, up: number, closer = 1): void {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const radius = Math.min(20, Math.max(0.4, offset.length() * closer));
    const angle = Math.atan2(offset.x, offset.z) + around;
    const polar = Math.min(Math.PI - 0.05, Math.max(0.05, Math.acos(offset.y / offset.length()) - up));
    offset.setFromSphericalCoords(radius, polar, angle);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
  }

  /** Turn together with the other from now on; it begins with the view of this one. */
  turnWith(other: Stage): void {
    this.partner = other;
    other.partner = this;
    other.follow(this);
  }

  private follow(other: Stage): void {
    if (this.camera.position.equals(other.camera.position) && this.controls.target.equals(other.controls.target)) return;
    this.camera.position.copy(other.camera.position);
    this.controls.target.copy(other.controls.target);
    this.camera.lookAt(this.controls.target);
    this.controls.update();
    this.draw();
  }

  /** What is seen now, as a picture. */
  picture(): Promise<Blob | null> {
    this.renderer.render(this.scene, this.camera);
    return new Promise((resolve) => this.renderer.domElement.toBlob(resolve, "image/png"));
  }

  private resize(): void {
    const canvas = this.renderer.domElement;
    const { clientWidth: width, clientHeight: height } = canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(MOST_PIXELS, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  private draw(): void {
    this.frame ||= requestAnimationFrame(() => {
      this.frame = 0;
      this.renderer.render(this.scene, this.camera);
    });
  }

  private clear(): void {
    for (const object of [this.mesh, this.wire]) {
      if (!object) continue;
      this.scene.remove(object);
      object.geometry.dispose();
    }
    this.mesh = this.wire = null;
  }

  dispose(): void {
    cancelAnimationFrame(this.frame);
    if (this.partner) this.partner.partner = null;
    this.observer.disconnect();
    this.controls.dispose();
    this.clear();
    this.material.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }
}
