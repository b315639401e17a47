"""The network of contacts: coordination number, distribution and anisotropy of forces, fabric tensor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.polygons import FloatArray
from ..base.result_file import ResultError
from ..read.frames import Frame


def rattlers(frame: Frame, least: int = 2) -> npt.NDArray[np.bool_]:
    """Which bodies carry no load: free ones with fewer than `least` contacts, not counting those with rattlers, (n).

    Bodies are removed until all that are left have `least` contacts. With friction a body needs two contacts to be
    supported without gravity, without friction three (I. Agnolin & J.-N. Roux, Phys. Rev. E 76 (2007) 061302).
    Contacts of several pieces of the same two bodies count once.
    """
    contacts = frame.contacts
    out = np.zeros(len(frame), dtype=bool)
    while True:
        kept = contacts.is_first & ~(out[contacts.first_index] | out[contacts.second_index])
        ends = np.concatenate([contacts.first_index[kept], contacts.second_index[kept]])
        few = frame.free & ~out & (np.bincount(ends, minlength=len(frame)) < least)
        if not few.any():
            return out
        out |= few


def coordination_number(frame: Frame, *, with_rattlers: bool = True, least: int = 2) -> float:
    """Mean number of contacts of the free bodies, Z = (2 N_ff + N_fw)/N (Bernal & Mason, Nature 188 (1960) 910).

    N_ff contacts of two free bodies, N_fw of a free and a fixed one, N free bodies. Two bodies have one contact,
    whatever and with however many pieces they touch. Without rattlers these bodies and their contacts are left out.
    NaN if no body is left.
    """
    out = np.zeros(len(frame), dtype=bool) if with_rattlers else rattlers(frame, least)
    contacts = frame.contacts
    kept = contacts.is_first & ~(out[contacts.first_index] | out[contacts.second_index])
    ends = np.concatenate([contacts.first_index[kept], contacts.second_index[kept]])
    n = int((frame.free & ~out).sum())
    return float(frame.free[ends].sum()) / n if n else float("nan")


@dataclass(frozen=True)
class Distribution:
    """A distribution of forces divided by their mean.

    Fields:

        edges    [1]    edges of the bins, in units of the mean, (bins + 1)
        density  [1]    probability density in each bin; its sum times the widths of the bins is 1, (bins)
        mean     [N/m]  the mean
        count    [1]    number of contacts
    """

    edges: FloatArray
    density: FloatArray
    mean: float
    count: int

    @property
    def centres(self) -> FloatArray:
        """Centres of the bins, in units of the mean [1], (bins)."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])


def force_distribution(frame: Frame, part: str = "normal", bins: int | FloatArray = 40) -> Distribution:
    """Probability density P(f/<f>) of contact forces: `part` is normal, tangential (magnitudes) or total.

    Contacts without a force of this kind are not counted (F. Radjai et al., Phys. Rev. Lett. 77 (1996) 274).
    """
    contacts = frame.contacts
    values = {"normal": contacts.normal_force, "tangential": np.abs(contacts.tangential_force),
              "total": contacts.force_magnitude}
    if part not in values:
        raise ResultError(f"there is no part {part} of forces; there are {', '.join(values)}")
    forces = values[part][values[part] > 0.0]
    if len(forces) == 0:
        raise ResultError(f"no contact of step {frame.step} has a {part} force")
    mean = float(forces.mean())
    density, edges = np.histogram(forces / mean, bins=bins, density=True)
    return Distribution(edges, density, mean, len(forces))


def fabric_tensor(frame: Frame, chosen: Any = None) -> FloatArray:
    """Fabric tensor F_ij = <n_i n_j>, (2, 2): the mean over contacts of the dyads of contact normals; its trace is 1.

    All contacts count unless `chosen` selects some (M. Satake, Proc. IUTAM Conf. Deformation and Failure of Granular
    Materials, Delft (1982) 63).
    """
    normal = _chosen(frame, chosen, frame.contacts.normal)
    return _mean_dyad(normal, normal)


@dataclass(frozen=True)
class Anisotropy:
    """Anisotropies of contacts and their forces; 0: isotropic.

    Fields:

        contacts    [1]    of the directions of contacts, a_c
        normal      [1]    of the normal forces, a_n
        tangential  [1]    of the tangential forces, a_t
        angle       [rad]  direction of most contacts, from the x axis, in (-pi/2, pi/2]
    """

    contacts: float
    normal: float
    tangential: float
    angle: float


def anisotropy(frame: Frame, chosen: Any = None) -> Anisotropy:
    """Anisotropies a_c, a_n and a_t of contact directions, normal and tangential forces.

    E(theta) = (1 + a_c cos 2(theta - theta_c))/2 pi is the density of contact directions, f_n(theta) =
    <f_n>(1 + a_n cos 2(theta - theta_n)) the mean normal force (L. Rothenburg & R.J. Bathurst, Geotechnique 39 (1989)
    601). They follow from tensors: with the fabric tensor F, chi^n = <f_n n n>/<f_n> and chi = <f n>/<f_n>, and the
    differences d of principal values over the traces, a_c = 2 d(F), a_n = 2 d(chi^n) - a_c and
    a_t = 2 d(chi) - a_c - a_n (E. Azema & F. Radjai, Phys. Rev. E 81 (2010) 051304), which holds as far as the three
    tensors have the same principal directions. Forces on the first body are taken with the sign that makes repulsion
    positive. All contacts count unless `chosen` selects some.
    """
    contacts = frame.contacts
    normal, force = (_chosen(frame, chosen, each) for each in (contacts.normal, -contacts.force))
    size = np.sum(force * normal, axis=1)
    if size.sum() == 0.0:
        raise ResultError(f"no contact of step {frame.step} has a normal force")
    fabric = _mean_dyad(normal, normal)
    of_contacts = 2.0 * _difference(fabric)
    of_normals = 2.0 * _difference(_mean_dyad(size[:, None] * normal, normal)) - of_contacts
    of_all = 2.0 * _difference(_mean_dyad(force, normal))
    angle = 0.5 * float(np.arctan2(2.0 * fabric[0, 1], fabric[0, 0] - fabric[1, 1]))
    return Anisotropy(of_contacts, of_normals, of_all - of_contacts - of_normals, angle)


def _chosen(frame: Frame, chosen: Any, values: FloatArray) -> FloatArray:
    if len(values) == 0:
        raise ResultError(f"there are no contacts at step {frame.step}")
    return values if chosen is None else values[chosen]


def _mean_dyad(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.einsum("ci,cj->ij", first, second) / len(first)


def _difference(tensor: FloatArray) -> float:
    """Difference of the principal values of the symmetric part of a tensor over its trace."""
    low, high = np.linalg.eigvalsh(0.5 * (tensor + tensor.T))
    return float((high - low) / (high + low))
