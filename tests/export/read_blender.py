"""Runs inside Blender: imports a file and writes the poses of its joints as JSON.

usage: blender -b --factory-startup --python-exit-code 1 --python read_blender.py -- FILE FRAMES NUMERATOR DENOMINATOR OUTPUT

output: {"rate", "skeletons": [{"bones", "bind", "frames"}]}; a pose is x y z qx qy qz qw in m and the axes of the file
(y up). A rotation is that from the bind pose, so that the axes of Blender's bones do not matter.
"""

import json
import sys

import bpy
from mathutils import Matrix

FILE, FRAMES, NUMERATOR, DENOMINATOR, OUTPUT = sys.argv[sys.argv.index("--") + 1:]
# Blender is z up: x, -z, y of the file.
FILE_FROM_BLENDER = Matrix(((1, 0, 0), (0, 0, 1), (0, -1, 0)))


def import_bvh(path):
    import io_anim_bvh.import_bvh as reader
    # The importer opens files with the mode "rU", which newer versions of Python refuse.
    reader.open = lambda name, mode="r", *rest, **named: open(name, mode.replace("U", ""), *rest, **named)
    bpy.ops.import_anim.bvh(filepath=path, global_scale=0.01, update_scene_fps=True, update_scene_duration=True)
    return 1.0


def import_fbx(path):
    bpy.ops.import_scene.fbx(filepath=path)
    return 1.0


def import_glb(path):
    import numpy
    numpy.bool = bool  # the importer uses the alias, which newer versions of numpy do not have
    bpy.context.scene.render.fps = 30  # keys are at time * fps
    bpy.ops.import_scene.gltf(filepath=path)
    return 0.0


def pose(position, rotation):
    q = (FILE_FROM_BLENDER @ rotation @ FILE_FROM_BLENDER.transposed()).to_quaternion()
    return [*(FILE_FROM_BLENDER @ position), q.x, q.y, q.z, q.w]


def rotation_of(matrix):
    return matrix.to_quaternion().to_matrix()


def poses(armature, binds):
    found = []
    for bone, bind in zip(armature.pose.bones, binds):
        world = armature.matrix_world @ bone.matrix
        found.append(pose(world.translation, rotation_of(world) @ rotation_of(bind).transposed()))
    return found


bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
suffix = FILE.rsplit(".", 1)[1]
first = {"bvh": import_bvh, "fbx": import_fbx, "glb": import_glb}[suffix](FILE)
fps = scene.render.fps / scene.render.fps_base
rate = int(NUMERATOR) / int(DENOMINATOR)
armatures = [thing for thing in scene.objects if thing.type == "ARMATURE"]
binds = [[armature.matrix_world @ bone.bone.matrix_local for bone in armature.pose.bones] for armature in armatures]
skeletons = [{"bones": [bone.name for bone in armature.pose.bones],
              "bind": [pose(bind.translation, Matrix.Identity(3)) for bind in of_armature],
              "frames": []} for armature, of_armature in zip(armatures, binds)]
# A frame of BVH is a frame of Blender. The importers of glTF and FBX multiply seconds by whole frames per second.
step = 1.0 if suffix == "bvh" else scene.render.fps / rate
for frame in range(int(FRAMES)):
    at = first + frame * step
    scene.frame_set(int(at), subframe=at - int(at))
    for armature, of_armature, skeleton in zip(armatures, binds, skeletons):
        skeleton["frames"].append(poses(armature, of_armature))
with open(OUTPUT, "w", encoding="utf-8") as output:
    json.dump({"rate": fps, "skeletons": skeletons}, output)
