"""Maps the topics of a stereo camera: ros2 launch dynvox_ros2 mapper.launch.py camera:=/stereo base_frame:=base_link"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import ComposableNodeContainer
from launch_ros.descriptions import ComposableNode
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {
    "camera": ("/stereo", "namespace with left/image_rect, left/camera_info, right/image_rect, right/camera_info"),
    "base_frame": ("", "frame that moves in the map; empty: the left camera's own"),
    "map_frame": ("map", "name of the world"),
    "memory_mib": ("256", "all memory of the mapper, MiB"),
}
PARAMETERS = {"base_frame": str, "map_frame": str, "memory_mib": int}


def generate_launch_description():
    value = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    topics = [f"{side}/{topic}" for side in ("left", "right") for topic in ("image_rect", "camera_info")]
    # Cameras that join this container hand their images over without a copy.
    mapper = ComposableNode(
        package="dynvox_ros2",
        plugin="dynvox_ros2::MapperNode",
        name="dynvox_mapper",
        parameters=[{name: ParameterValue(value[name], value_type=kind) for name, kind in PARAMETERS.items()}],
        remappings=[(topic, [value["camera"], f"/{topic}"]) for topic in topics],
        extra_arguments=[{"use_intra_process_comms": True}],
    )
    container = ComposableNodeContainer(
        name="dynvox", namespace="", package="rclcpp_components", executable="component_container", composable_node_descriptions=[mapper]
    )
    arguments = [DeclareLaunchArgument(name, default_value=default, description=text) for name, (default, text) in ARGUMENTS.items()]
    return LaunchDescription([*arguments, container])
