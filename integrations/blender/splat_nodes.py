# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry nodes and materials that show splats: as points, or as ellipsoids for renders.

Ellipsoids are `EXTENT` standard deviations large and have the opacity of a splat throughout: a preview, not
an image of splats.
"""

import bpy

GROUP = "cagefield splats"
MODIFIER = "cagefield splats"
ELLIPSOIDS = "Ellipsoids"
EXTENT = 1.5
RADIUS = 0.8


def show_as_splats(thing):
    """Gives an object of splats the modifier that shows them."""
    modifier = thing.modifiers.get(MODIFIER) or thing.modifiers.new(MODIFIER, "NODES")
    modifier.node_group = bpy.data.node_groups.get(GROUP) or _group()


def shows_ellipsoids(thing):
    """True where an object's splats are shown as ellipsoids."""
    modifier = thing.modifiers.get(MODIFIER)
    return modifier is not None and bool(modifier[_identifier(modifier.node_group)])


def show_ellipsoids(thing, shown):
    """Shows an object's splats as ellipsoids, or as points."""
    modifier = thing.modifiers.get(MODIFIER)
    if modifier is not None:
        modifier[_identifier(modifier.node_group)] = bool(shown)
        thing.update_tag()


def _identifier(group):
    return next(item.identifier for item in group.interface.items_tree if item.name == ELLIPSOIDS)


def _group():
    group = bpy.data.node_groups.new(GROUP, "GeometryNodeTree")
    group.is_modifier = True
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket(ELLIPSOIDS, in_out="INPUT", socket_type="NodeSocketBool")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, links = group.nodes, group.links
    entry, exit = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")

    def attribute(name, data_type):
        node = nodes.new("GeometryNodeInputNamedAttribute")
        node.data_type = data_type
        node.inputs["Name"].default_value = name
        return node.outputs["Attribute"]

    def scaled(value, factor):
        node = nodes.new("ShaderNodeVectorMath")
        node.operation = "SCALE"
        links.new(value, node.inputs["Vector"])
        node.inputs["Scale"].default_value = factor
        return node.outputs["Vector"]

    def with_material(geometry, material):
        node = nodes.new("GeometryNodeSetMaterial")
        links.new(geometry, node.inputs["Geometry"])
        node.inputs["Material"].default_value = material
        return node.outputs["Geometry"]

    points = nodes.new("GeometryNodeMeshToPoints")
    links.new(entry.outputs["Geometry"], points.inputs["Mesh"])
    radius = nodes.new("ShaderNodeMath")
    radius.operation = "MULTIPLY"
    radius.inputs[1].default_value = RADIUS
    links.new(attribute("splat_radius", "FLOAT"), radius.inputs[0])
    links.new(radius.outputs["Value"], points.inputs["Radius"])

    sphere = nodes.new("GeometryNodeMeshIcoSphere")
    sphere.inputs["Radius"].default_value = 1.0
    sphere.inputs["Subdivisions"].default_value = 2
    instances = nodes.new("GeometryNodeInstanceOnPoints")
    links.new(points.outputs["Points"], instances.inputs["Points"])
    links.new(
        with_material(sphere.outputs["Mesh"], _material("cagefield ellipsoids", "INSTANCER")),
        instances.inputs["Instance"],
    )
    links.new(attribute("splat_rotation", "QUATERNION"), instances.inputs["Rotation"])
    links.new(scaled(attribute("splat_size", "FLOAT_VECTOR"), EXTENT), instances.inputs["Scale"])

    switch = nodes.new("GeometryNodeSwitch")
    switch.input_type = "GEOMETRY"
    links.new(entry.outputs[ELLIPSOIDS], switch.inputs["Switch"])
    links.new(
        with_material(points.outputs["Points"], _material("cagefield points", "GEOMETRY")),
        switch.inputs["False"],
    )
    links.new(instances.outputs["Instances"], switch.inputs["True"])
    links.new(switch.outputs["Output"], exit.inputs["Geometry"])
    return group


def _material(name, attribute_type):
    """A material that shines in the splats' color, and lets their opacity through."""
    material = bpy.data.materials.get(name)
    if material is not None:
        return material
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # of Blender before 5.0
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    color = nodes.new("ShaderNodeAttribute")
    color.attribute_type = attribute_type
    color.attribute_name = "splat_color"
    emission, clear = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeBsdfTransparent")
    mix, output = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeOutputMaterial")
    links.new(color.outputs["Color"], emission.inputs["Color"])
    links.new(color.outputs["Alpha"], mix.inputs["Fac"])
    links.new(clear.outputs["BSDF"], mix.inputs[1])
    links.new(emission.outputs["Emission"], mix.inputs[2])
    links.new(mix.outputs["Shader"], output.inputs["Surface"])
    return material
