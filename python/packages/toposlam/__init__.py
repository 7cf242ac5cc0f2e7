"""Topological SLAM: ring frames and places in, maps out, with the Rust library of the robot.

    from toposlam import Mapper

    mapper = Mapper(16)                                  # sixteen sensors, evenly spaced
    for ranges_mm in frames:                             # millimetres; None without an echo
        if observed := mapper.observe(ranges_mm):
            place, update = observed
            print(place.radius_mm, update.vertex)
    print(mapper.map.edges)

The classes have the names of their types in the Rust library. Lengths are in millimetres, angles in milliradians, counter-clockwise.
Invalid values raise ValueError, values of another type TypeError.
"""

from ._core import *
from ._core import __all__ as __all__
