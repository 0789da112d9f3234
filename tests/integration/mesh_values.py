"""Values of polygons on a lattice by brute force: every sample is tested against every polygon."""

import numpy as np


class Polygons:
    """corners: for each cell a list of nodes; lon, lat of the nodes in degrees, or lengths. Cells
    must not contain a pole or have a corner there."""

    def __init__(self, corners, x, y, wraps=True):
        self.corners = [list(c) for c in corners]
        self.x, self.y, self.wraps = np.asarray(x, float), np.asarray(y, float), wraps
        self.outlines = []
        for cell in self.corners:
            along = self.x[cell]
            if wraps:
                along = along[0] + (along - along[0] + 180) % 360 - 180
            self.outlines.append((along, self.y[cell]))

    def centroid(self, cell):
        px, py = self.outlines[cell]
        x0, y0 = px[0], py[0]
        px, py = px - x0, py - y0
        qx, qy = np.roll(px, -1), np.roll(py, -1)
        cross = px * qy - qx * py
        area = cross.sum() / 2
        return (x0 + ((px + qx) * cross).sum() / (6 * area),
                y0 + ((py + qy) * cross).sum() / (6 * area))

    def near(self, x, to):
        return to + (x - to + 180) % 360 - 180 if self.wraps else x

    def owners(self, xs, ys):
        """The cell around each sample (y, x), -1: none."""
        grid_x, grid_y = np.meshgrid(xs, ys)
        found = np.full(grid_x.shape, -1)
        for cell, (px, py) in enumerate(self.outlines):
            x = self.near(grid_x, px.mean())
            inside = np.zeros(x.shape, bool)
            for a in range(len(px)):
                b = (a + 1) % len(px)
                if py[a] == py[b]:
                    continue
                crosses = (py[a] <= grid_y) != (py[b] <= grid_y)
                at = px[a] + (grid_y - py[a]) / (py[b] - py[a]) * (px[b] - px[a])
                inside ^= crosses & (at <= x)
            assert not np.any(inside & (found >= 0)), "cells overlap"
            found[inside] = cell
        return found

    def node_values(self, cells):
        """Of values at cells (..., cell): means around the nodes, exact for linear functions, with
        weights as near to 1 as possible (least squares), at least 0; equal if their mean is below a
        quarter. NaN does not count."""
        cells = np.asarray(cells, float)
        around = [[] for _ in self.x]
        for cell, corners in enumerate(self.corners):
            for node in corners:
                around[node].append(cell)
        places = [self.centroid(c) for c in range(len(self.corners))]
        out = np.full(cells.shape[:-1] + (len(self.x),), np.nan)
        for node, mine in enumerate(around):
            if not mine:
                continue
            offsets = np.array([[self.near(places[c][0], self.x[node]) - self.x[node],
                                 places[c][1] - self.y[node]] for c in mine]).T
            if self.wraps:
                offsets[0] *= np.cos(np.radians(self.y[node]))
            weights = np.ones(len(mine))
            spread = offsets @ offsets.T
            if np.linalg.det(spread) > 1e-6 * np.trace(spread) ** 2:
                weights -= np.linalg.pinv(offsets) @ (offsets @ weights)
            weights = np.maximum(weights, 0)
            if weights.mean() < 0.25:
                weights = np.ones(len(mine))
            values = cells[..., mine]
            share = np.where(np.isnan(values), 0, weights)
            with np.errstate(invalid="ignore", divide="ignore"):
                out[..., node] = (share * np.nan_to_num(values)).sum(-1) / share.sum(-1)
        return out

    def on_lattice(self, xs, ys, cells=None, nodes=None):
        """Values (..., y, x), NaN outside: linear in the triangles between a point within each cell
        and its edges."""
        at_cells = cells is not None
        given = np.asarray(cells if at_cells else nodes, float)
        at_nodes = self.node_values(given) if at_cells else given
        owners = self.owners(xs, ys)
        out = np.full(given.shape[:-1] + owners.shape, np.nan)
        for j, i in np.argwhere(owners >= 0):
            cell = owners[j, i]
            px, py = self.outlines[cell]
            corners = self.corners[cell]
            if at_cells:
                apex, value = self.centroid(cell), given[..., cell]
            else:
                apex, value = (px.mean(), py.mean()), at_nodes[..., corners].mean(-1)
            x, y = self.near(xs[i], apex[0]) - apex[0], ys[j] - apex[1]
            best, chosen = -np.inf, None
            for a in range(len(px)):
                b = (a + 1) % len(px)
                matrix = np.array([[px[a] - apex[0], px[b] - apex[0]],
                                   [py[a] - apex[1], py[b] - apex[1]]])
                if abs(np.linalg.det(matrix)) < 1e-14:
                    continue
                s, t = np.linalg.solve(matrix, [x, y])
                if min(s, t, 1 - s - t) > best:
                    best, chosen = min(s, t, 1 - s - t), (a, b, s, t)
            a, b, s, t = chosen
            assert best > -1e-9, "not in its cell"
            out[..., j, i] = ((1 - s - t) * value + s * at_nodes[..., corners[a]]
                              + t * at_nodes[..., corners[b]])
        return out


def check_lattice(xs, ys, polygons):
    """The lattice is even and covers the polygons, whatever its turn."""
    for values in (xs, ys):
        assert np.allclose(np.diff(values), values[1] - values[0], rtol=1e-9), "uneven"
    half = (xs[1] - xs[0]) / 2
    high = [polygons.near(px, (xs[0] + xs[-1]) / 2).max() for px, _ in polygons.outlines]
    low = [polygons.near(px, (xs[0] + xs[-1]) / 2).min() for px, _ in polygons.outlines]
    closes = polygons.wraps and abs(xs[-1] - xs[0] + 2 * half - 360) < 1e-6
    assert closes or abs(min(low) - (xs[0] - half)) < 1e-6 * 360, "west"
    assert closes or abs(max(high) - (xs[-1] + half)) < 1e-6 * 360, "east"
    half = (ys[1] - ys[0]) / 2
    assert abs(min(py.min() for _, py in polygons.outlines) - (ys[0] - half)) < 1e-6, "south"
    assert abs(max(py.max() for _, py in polygons.outlines) - (ys[-1] + half)) < 1e-6, "north"
