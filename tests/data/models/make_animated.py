#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Write bar.glb: a bar on two bones that bends to both sides in a second, and swells by a morph target of an animation of its own."""
import json, struct, sys
import numpy as np

def make(path, seconds=1.0, rings=9, around=8):
    y = np.linspace(0, 2, rings); a = 2*np.pi*np.arange(around)/around
    pts = np.array([(0.3*np.cos(t), h, 0.3*np.sin(t)) for h in y for t in a] + [(0,0,0),(0,2,0)], np.float32)
    idx = lambda r, k: r*around + k % around
    faces = []
    for r in range(rings-1):
        for k in range(around):
            faces += [(idx(r,k), idx(r+1,k), idx(r+1,k+1)), (idx(r,k), idx(r+1,k+1), idx(r,k+1))]
    n = len(pts)
    for k in range(around):
        faces += [(n-2, idx(0,k), idx(0,k+1)), (n-1, idx(rings-1,k+1), idx(rings-1,k))]
    faces = np.array(faces, np.uint16)
    w1 = np.clip((pts[:,1]-0.75)/0.5, 0, 1).astype(np.float32)
    joints = np.zeros((n,4), np.uint8); joints[:,1] = 1
    weights = np.stack([1-w1, w1, 0*w1, 0*w1], 1).astype(np.float32)
    bulge = np.zeros_like(pts); side = np.exp(-((pts[:,1]-1)/0.4)**2)[:,None]
    bulge[:,[0,2]] = pts[:,[0,2]]*side*1.0
    ibm = np.stack([np.eye(4), np.eye(4)]).astype(np.float32); ibm[1,3,1] = -1  # column-major: translation in row 3
    times = np.linspace(0, seconds, 5).astype(np.float32)
    angle = np.radians([0, 60, 0, -60, 0])
    rot = np.stack([0*angle, 0*angle, np.sin(angle/2), np.cos(angle/2)], 1).astype(np.float32)
    morph = np.array([0, 1, 0, 1, 0], np.float32)
    blob, views, accessors = b'', [], []
    def add(array, kind, ctype, target=None, bounds=False):
        nonlocal blob
        blob += b'\0'*(-len(blob)%4)
        view = {"buffer":0,"byteOffset":len(blob),"byteLength":array.nbytes}
        if target: view["target"] = target
        views.append(view); blob += array.tobytes()
        acc = {"bufferView":len(views)-1,"componentType":ctype,"count":len(array) if kind!="SCALAR" else array.size,"type":kind}
        if bounds:
            flat = array.reshape(acc["count"],-1); acc["min"]=[float(v) for v in flat.min(0)]; acc["max"]=[float(v) for v in flat.max(0)]
        accessors.append(acc); return len(accessors)-1
    F,U16,U8 = 5126,5123,5121
    pos = add(pts,"VEC3",F,34962,True); ind = add(faces.reshape(-1),"SCALAR",U16,34963)
    jo = add(joints,"VEC4",U8,34962); we = add(weights,"VEC4",F,34962); bu = add(bulge,"VEC3",F,34962,True)
    ib = add(ibm,"MAT4",F); ti = add(times,"SCALAR",F,None,True); ro = add(rot,"VEC4",F); mo = add(morph,"SCALAR",F)
    gltf = {"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,3]}],
      "nodes":[{"name":"root","children":[1]},{"name":"upper","translation":[0,1,0]},{"name":"unused"},
               {"name":"body","mesh":0,"skin":0,"translation":[5,5,5]}],
      "meshes":[{"name":"body","primitives":[{"attributes":{"POSITION":pos,"JOINTS_0":jo,"WEIGHTS_0":we},"indices":ind,"material":0,"targets":[{"POSITION":bu}]}],"weights":[0]}],
      "materials":[{"name":"skin","pbrMetallicRoughness":{"baseColorFactor":[0.6,0.25,0.1,1],"metallicFactor":0,"roughnessFactor":0.6}}],
      "skins":[{"joints":[0,1],"inverseBindMatrices":ib,"skeleton":0}],
      "animations":[{"name":"bend","samplers":[{"input":ti,"output":ro,"interpolation":"LINEAR"}],"channels":[{"sampler":0,"target":{"node":1,"path":"rotation"}}]},
                    {"name":"breathe","samplers":[{"input":ti,"output":mo,"interpolation":"LINEAR"}],"channels":[{"sampler":0,"target":{"node":3,"path":"weights"}}]}],
      "buffers":[{"byteLength":0}],"bufferViews":views,"accessors":accessors}
    gltf["buffers"][0]["byteLength"] = len(blob)
    j = json.dumps(gltf,separators=(',',':')).encode(); j += b' '*(-len(j)%4); blob += b'\0'*(-len(blob)%4)
    with open(path,'wb') as f:
        f.write(struct.pack('<4sII',b'glTF',2,12+8+len(j)+8+len(blob))); f.write(struct.pack('<I4s',len(j),b'JSON')); f.write(j)
        f.write(struct.pack('<I4s',len(blob),b'BIN\0')); f.write(blob)
make(sys.argv[1] if len(sys.argv) > 1 else "bar.glb")
