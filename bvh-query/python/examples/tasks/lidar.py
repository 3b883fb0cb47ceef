"""What does a sensor see? A scan of rays in a scene.

It prints:

    11168 of 11520 rays hit something within 4000
      room: 9598 rays, the nearest 803.431 away
      ball: 683 rays, the nearest 822.505 away
      robot: 887 rays, the nearest 1062.669 away
    the points are within [-2995.5 -2995.5    -5.5] and [1025.9 2995.5 1632.8]
"""

import numpy as np

import cbvh

scene = cbvh.Scene()
scene.add(cbvh.bake_files("testdata/fclenv.obj", "room.cbvh"), name="room")
scene.add(cbvh.sphere(300), cbvh.pose([1000, 500, 500]), name="ball")
scene.add(cbvh.bake_files("testdata/fclrob.obj", "robot.cbvh"), cbvh.pose([-1200, -600, 500]), name="robot")
scene.parallel = True

# Sixteen rings of 720 rays each. Directions of unit length, so that t is in mesh units.
azimuth, elevation = np.meshgrid(np.linspace(0, 2 * np.pi, 720, endpoint=False), np.radians(np.linspace(-15, 15, 16)))
rays = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1)
hits = scene.first_hits([0, 0, 600], rays.reshape(-1, 3), until=4000.0)

found = hits.hit.found
print(f"{found.sum()} of {found.size} rays hit something within 4000")
for id in scene:
    seen = hits.instance == id
    print(f"  {scene.name(id)}: {seen.sum()} rays, the nearest {np.min(hits.hit.t[seen], initial=np.inf):.3f} away")
cloud = hits.hit.point[found]  # as a sensor driver would give it
print("the points are within", cloud.min(axis=0).round(1), "and", cloud.max(axis=0).round(1))
