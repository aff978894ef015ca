// Reads a file with a loader of three.js and prints the poses of its joints as JSON.
//
// usage: node read_three.mjs FILE FRAMES RATE     FILE: .bvh, .glb, .fbx or .usda; RATE in Hz
// output: {"frames_per_clip", "duration_s", "skeletons": [{"name", "bones", "bind", "frames"}]}; a pose is x y z qx qy qz qw
// in the axes and unit of the loader's scene

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const modules = process.env.MOCAP_NODE_MODULES;
const three = join(modules, "three");
const loader = (name) => import(pathToFileURL(join(three, "examples/jsm/loaders", name + ".js")));
const THREE = await import(pathToFileURL(join(three, "build/three.module.js")));
console.log = console.warn = () => {}; // loaders print notes there

const readers = {
  async bvh(bytes) {
    const { BVHLoader } = await loader("BVHLoader");
    const { skeleton, clip } = new BVHLoader().parse(bytes.toString());
    const root = new THREE.Group();
    root.add(skeleton.bones[0]);
    return { root, clips: [clip], skeletons: [{ name: "", skeleton }] };
  },
  async glb(bytes) {
    globalThis.self = globalThis;
    const { GLTFLoader } = await loader("GLTFLoader");
    const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
    const gltf = await new GLTFLoader().parseAsync(buffer, "");
    return { root: gltf.scene, clips: gltf.animations };
  },
  async fbx(bytes) {
    globalThis.window = globalThis;
    const { FBXLoader } = await loader("FBXLoader");
    const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
    const root = new FBXLoader().parse(buffer, "");
    return { root, clips: root.animations };
  },
  async usda(bytes) {
    const { USDLoader } = await loader("USDLoader");
    const root = new USDLoader().parse(bytes.toString());
    return { root, clips: root.animations };
  },
};

function pose(matrix) {
  const [p, q, s] = [new THREE.Vector3(), new THREE.Quaternion(), new THREE.Vector3()];
  matrix.decompose(p, q, s);
  return [...p.toArray(), ...q.toArray()];
}

const [file, frames, rate] = [process.argv[2], Number(process.argv[3]), Number(process.argv[4])];
const found = await readers[file.split(".").pop()](readFileSync(file));
const skinned = [];
found.root.traverse((node) => node.isSkinnedMesh && skinned.push(node));
const skeletons = found.skeletons ?? skinned.map((mesh) => ({ name: mesh.name, skeleton: mesh.skeleton }));
found.root.updateMatrixWorld(true);
const output = skeletons.map(({ name, skeleton }) => ({
  name,
  bones: skeleton.bones.map((bone) => bone.name),
  bind: skeleton.bones.map((bone, i) => pose(skeleton.boneInverses[i].clone().invert())),
  frames: [],
}));
const mixer = new THREE.AnimationMixer(found.root);
for (const clip of found.clips) {
  const action = mixer.clipAction(clip);
  action.loop = THREE.LoopOnce;
  action.clampWhenFinished = true;
  action.play();
}
for (let frame = 0; frame < frames; ++frame) {
  mixer.setTime(frame / rate);
  found.root.updateMatrixWorld(true);
  skeletons.forEach(({ skeleton }, i) => output[i].frames.push(skeleton.bones.map((bone) => pose(bone.matrixWorld))));
}
process.stdout.write(JSON.stringify({ duration_s: found.clips.map((clip) => clip.duration), skeletons: output }));
