#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Write rig.glb, and rig.txt with what Blender itself shows: "animation frame x y z" for every vertex, y up.

A square tube on an armature of two bones with a shape key, a texture that a mapping node turns, and a cube that the
armature's object carries. The film has 30 frames per second from frame 10 on; the armature has two actions, Bend and Wave.
Needs Blender 5 as a module: pip install bpy==5.0.1
"""
import sys

import bpy
from mathutils import Vector

FIRST, RATE, RINGS = 10, 30, 5


def material(name, textured):
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    if textured:
        nodes, links = m.node_tree.nodes, m.node_tree.links
        image = bpy.data.images.new("checks", 4, 4)
        image.pixels = [c for y in range(4) for x in range(4) for c in ((1, 0.5, 0, 1) if (x + y) % 2 else (0, 0.2, 0.6, 1))]
        image.pack()
        texture, mapping, uv = (nodes.new(n) for n in ("ShaderNodeTexImage", "ShaderNodeMapping", "ShaderNodeUVMap"))
        texture.image, uv.uv_map = image, "UVMap"
        mapping.inputs["Location"].default_value = (0.25, 0.125, 0)
        mapping.inputs["Rotation"].default_value = (0, 0, 0.5)
        mapping.inputs["Scale"].default_value = (3, 2, 1)
        links.new(uv.outputs[0], mapping.inputs[0])
        links.new(mapping.outputs[0], texture.inputs[0])
        links.new(texture.outputs[0], nodes["Principled BSDF"].inputs["Base Color"])
    return m


def tube():
    corners = [(0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)]
    points = [(x, y, 2 * r / (RINGS - 1)) for r in range(RINGS) for x, y in corners]
    faces = [(4 * r + k, 4 * r + (k + 1) % 4, 4 * r + 4 + (k + 1) % 4, 4 * r + 4 + k) for r in range(RINGS - 1) for k in range(4)]
    faces += [(3, 2, 1, 0), tuple(4 * RINGS - 4 + k for k in range(4))]
    mesh = bpy.data.meshes.new("Tube")
    mesh.from_pydata(points, [], faces)
    uv = mesh.uv_layers.new(name="UVMap")
    for loop, place in zip(mesh.loops, uv.data):
        p = mesh.vertices[loop.vertex_index].co
        place.uv = (p.x + p.y / 2, p.z / 2)
    mesh.materials.append(material("Checks", True))
    tube = bpy.data.objects.new("Tube", mesh)
    bpy.context.collection.objects.link(tube)
    tube.shape_key_add(name="Basis")
    key = tube.shape_key_add(name="Bulge")
    for point, vertex in zip(key.data, mesh.vertices):
        if 0.4 < vertex.co.z < 1.6:
            point.co = vertex.co + Vector((vertex.co.x, vertex.co.y, 0))
    for frame, value in ((0, 0), (9, 1), (18, 0)):
        key.value = value
        key.keyframe_insert("value", frame=FIRST + frame)
    return tube


def rig(tube):
    armature = bpy.data.armatures.new("Rig")
    rig = bpy.data.objects.new("Rig", armature)
    bpy.context.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for name, low, high in (("Lower", 0, 1), ("Upper", 1, 2)):
        bone = armature.edit_bones.new(name)
        bone.head, bone.tail = (0, 0, low), (0, 0, high)
        bone.parent = armature.edit_bones.get("Lower") if low else None
    bpy.ops.object.mode_set(mode="OBJECT")
    for name, weights in (("Lower", (1, 1, 0.5, 0, 0)), ("Upper", (0, 0, 0.5, 1, 1))):
        group = tube.vertex_groups.new(name=name)
        for ring, weight in enumerate(weights):
            group.add(range(4 * ring, 4 * ring + 4), weight, "REPLACE")
    tube.modifiers.new("Armature", "ARMATURE").object = rig
    tube.parent = rig
    bpy.ops.mesh.primitive_cube_add(size=0.3, location=(0.8, 0, 0.15))
    cube = bpy.context.object
    cube.data.materials.append(material("Plain", False))
    cube.parent = rig
    cube.scale = (-1, 1, 1)  # mirrored
    return rig


def action(rig, name, axis, length):
    rig.animation_data_create().action = bpy.data.actions.new(name)
    rig.animation_data.action.use_fake_user = True
    bone = rig.pose.bones["Upper"]
    bone.rotation_mode = "XYZ"
    for frame, angle in ((0, 0), (length // 2, 1.2), (length, 0)):
        turn = [0.0, 0.0, 0.0]
        turn[axis] = angle
        bone.rotation_euler = turn
        bone.keyframe_insert("rotation_euler", frame=FIRST + frame)
        rig.location = (0, angle / 2, 0)
        rig.keyframe_insert("location", frame=FIRST + frame)
    return rig.animation_data.action


def evaluated_points(scene, frame):
    scene.frame_set(frame)
    graph = bpy.context.evaluated_depsgraph_get()
    for thing in scene.objects:
        if thing.type == "MESH":
            shown = thing.evaluated_get(graph)
            for vertex in shown.to_mesh().vertices:
                x, y, z = shown.matrix_world @ vertex.co
                yield x, z, -y


def main(folder):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = RATE
    scene.frame_start, scene.frame_end = FIRST, FIRST + 18
    armature = rig(tube())
    lines = []
    for name, axis, length in (("Wave", 2, 12), ("Bend", 0, 18)):
        armature.animation_data_clear()
        action(armature, name, axis, length)
        for frame in range(0, length + 1, 3):
            lines += [f"{name} {frame + 1} {x:.6f} {y:.6f} {z:.6f}" for x, y, z in evaluated_points(scene, FIRST + frame)]
    with open(f"{folder}/rig.txt", "w") as out:
        out.write("\n".join(lines) + "\n")
    bpy.ops.export_scene.gltf(filepath=f"{folder}/rig.glb", export_format="GLB")


main(sys.argv[1] if len(sys.argv) > 1 else ".")
