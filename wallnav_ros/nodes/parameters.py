# Copyright 2026 The wallnav_ros authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
Parameters with descriptions and ranges, declared in one call each.

REP-103 units; `params/wallnav.yaml` lists them all with their defaults.
"""

from dataclasses import fields

import numpy as np
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException


def declare(node, name, default, description, limits=None, choices=None, live=False):
    """
    Declare a parameter of `node` and return its value.

    limits: (low, high), inclusive, for numbers. choices: the strings allowed. live: whether it
    may change while the node runs. Raises ValueError (one line: parameter, value, what is
    allowed).
    """
    descriptor = ParameterDescriptor(
        description=description, read_only=not live,
        additional_constraints='' if live else 'fixed while the node runs: restart it to change')
    if choices is not None:
        descriptor.additional_constraints = '; '.join(filter(None, (
            f'one of {", ".join(choices)}', descriptor.additional_constraints)))
    if limits is not None and isinstance(default, float):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(limits[0]), to_value=float(limits[1]))]
    elif limits is not None:
        descriptor.integer_range = [
            IntegerRange(from_value=int(limits[0]), to_value=int(limits[1]))]
    try:
        value = node.declare_parameter(name, default, descriptor).value
    except InvalidParameterTypeException:
        raise ValueError(f'parameter {name}: expected {_kind(default)}, such as '
                         f'{default!r}') from None
    except InvalidParameterValueException:
        raise ValueError(f'parameter {name}: outside its limits, {limits[0]:g} to '
                         f'{limits[1]:g}') from None
    if choices is not None and value not in choices:
        raise ValueError(f'parameter {name}: {value!r} is not one of {", ".join(choices)}')
    if isinstance(default, float) and not np.isfinite(value):
        raise ValueError(f'parameter {name}: {value} is not a finite number')
    return value


def declare_pose(node, name, description, default=(0.0, 0.0, 0.0)):
    """
    Declare a pose x, y, yaw (metres, radians) of `node` and return it as an array (3,).

    Raises ValueError when it does not have three finite numbers.
    """
    value = declare(node, name, [float(part) for part in default], description)
    if len(value) != 3 or not np.isfinite(value).all():
        raise ValueError(f'parameter {name}: expected three finite numbers [x, y, yaw], '
                         f'got {list(value)}')
    return np.array(value)


def declare_settings(node, prefix, defaults, limits=(0.0, 1000.0)):
    """
    Declare every float field of the dataclass instance `defaults` under `prefix.`.

    Returns a new instance with the values given. Raises ValueError as `declare` does.
    """
    return type(defaults)(**{
        field.name: declare(node, f'{prefix}.{field.name}', getattr(defaults, field.name),
                            f'{type(defaults).__name__}.{field.name}', limits)
        for field in fields(defaults)})


def _kind(default):
    kinds = {bool: 'true or false', int: 'a whole number', float: 'a number with a decimal point',
             str: 'text'}
    return kinds.get(type(default), 'a list of numbers with decimal points')
