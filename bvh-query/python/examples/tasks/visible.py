"""Which places see which targets? Camera sites and a grid of points in a room.

It prints:

    from [-2400. -2400.  2000.]: 54.1% of the targets
    from [ 2400. -2400.  2000.]: 40.5% of the targets
    from [   0.    0. 2000.]: 73.1% of the targets
    from [2400. 2400. 2000.]: 46.5% of the targets
    sites 0 and 1 together: 87.0%
"""

import numpy as np

import cbvh

room = cbvh.bake_files("testdata/fclenv.obj", "room.cbvh")

# Targets on a grid at the height of a table, and four sites under the ceiling.
x, y = np.meshgrid(np.linspace(-2500, 2500, 51), np.linspace(-2500, 2500, 51))
targets = np.stack([x.ravel(), y.ravel(), np.full(x.size, 500.0)], axis=1)
sites = np.array([[-2400, -2400, 2000], [2400, -2400, 2000], [0, 0, 2000], [2400, 2400, 2000]], float)

# All pairs in one call: a line of sight may touch nothing, but within the margin of its ends.
starts, ends = np.repeat(sites, len(targets), axis=0), np.tile(targets, (len(sites), 1))
seen = room.visible(starts, ends, margin=1.0, parallel=True).reshape(len(sites), len(targets))
for site, row in zip(sites, seen):
    print(f"from {site}: {row.mean():.1%} of the targets")

# The best pair of sites.
pairs = [(a, b) for a in range(len(sites)) for b in range(a)]
a, b = max(pairs, key=lambda pair: (seen[pair[0]] | seen[pair[1]]).sum())
print(f"sites {b} and {a} together: {(seen[a] | seen[b]).mean():.1%}")
