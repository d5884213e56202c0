"""The message and service types that the simulated ROS graph knows.

Fields are in their order on the wire, in ROS 1 spelling; what differs between the
dialects is in :mod:`webmap.sim.rosbridge.dialect`.
"""

MESSAGES = {
    "std_msgs/Header": "uint32 seq; time stamp; string frame_id",
    "std_msgs/Empty": "",
    "std_msgs/String": "string data",
    "std_msgs/Bool": "bool data",
    "std_msgs/Int32": "int32 data",
    "std_msgs/UInt32": "uint32 data",
    "std_msgs/Float32": "float32 data",
    "std_msgs/Float64": "float64 data",
    "std_msgs/ColorRGBA": "float32 r; float32 g; float32 b; float32 a",
    "std_msgs/MultiArrayDimension": "string label; uint32 size; uint32 stride",
    "std_msgs/MultiArrayLayout": (
        "std_msgs/MultiArrayDimension[] dim; uint32 data_offset"
    ),
    "std_msgs/Float32MultiArray": "std_msgs/MultiArrayLayout layout; float32[] data",
    "std_msgs/UInt8MultiArray": "std_msgs/MultiArrayLayout layout; uint8[] data",
    "geometry_msgs/Vector3": "float64 x; float64 y; float64 z",
    "geometry_msgs/Point": "float64 x; float64 y; float64 z",
    "geometry_msgs/PointStamped": "std_msgs/Header header; geometry_msgs/Point point",
    "geometry_msgs/Point32": "float32 x; float32 y; float32 z",
    "geometry_msgs/Quaternion": "float64 x; float64 y; float64 z; float64 w",
    "geometry_msgs/Pose": (
        "geometry_msgs/Point position; geometry_msgs/Quaternion orientation"
    ),
    "geometry_msgs/Pose2D": "float64 x; float64 y; float64 theta",
    "geometry_msgs/PoseStamped": "std_msgs/Header header; geometry_msgs/Pose pose",
    "geometry_msgs/PoseArray": "std_msgs/Header header; geometry_msgs/Pose[] poses",
    "geometry_msgs/PoseWithCovariance": (
        "geometry_msgs/Pose pose; float64[36] covariance"
    ),
    "geometry_msgs/PoseWithCovarianceStamped": (
        "std_msgs/Header header; geometry_msgs/PoseWithCovariance pose"
    ),
    "geometry_msgs/Polygon": "geometry_msgs/Point32[] points",
    "geometry_msgs/PolygonStamped": (
        "std_msgs/Header header; geometry_msgs/Polygon polygon"
    ),
    "geometry_msgs/Twist": (
        "geometry_msgs/Vector3 linear; geometry_msgs/Vector3 angular"
    ),
    "geometry_msgs/TwistStamped": "std_msgs/Header header; geometry_msgs/Twist twist",
    "geometry_msgs/TwistWithCovariance": (
        "geometry_msgs/Twist twist; float64[36] covariance"
    ),
    "geometry_msgs/Transform": (
        "geometry_msgs/Vector3 translation; geometry_msgs/Quaternion rotation"
    ),
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header; string child_frame_id;"
        " geometry_msgs/Transform transform"
    ),
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "nav_msgs/Odometry": (
        "std_msgs/Header header; string child_frame_id;"
        " geometry_msgs/PoseWithCovariance pose;"
        " geometry_msgs/TwistWithCovariance twist"
    ),
    "nav_msgs/Path": "std_msgs/Header header; geometry_msgs/PoseStamped[] poses",
    "nav_msgs/MapMetaData": (
        "time map_load_time; float32 resolution; uint32 width; uint32 height;"
        " geometry_msgs/Pose origin"
    ),
    "nav_msgs/OccupancyGrid": (
        "std_msgs/Header header; nav_msgs/MapMetaData info; int8[] data"
    ),
    "nav_msgs/GridCells": (
        "std_msgs/Header header; float32 cell_width; float32 cell_height;"
        " geometry_msgs/Point[] cells"
    ),
    "sensor_msgs/LaserScan": (
        "std_msgs/Header header; float32 angle_min; float32 angle_max;"
        " float32 angle_increment; float32 time_increment; float32 scan_time;"
        " float32 range_min; float32 range_max; float32[] ranges;"
        " float32[] intensities"
    ),
    "sensor_msgs/BatteryState": (
        "std_msgs/Header header; float32 voltage; float32 temperature;"
        " float32 current; float32 charge; float32 capacity;"
        " float32 design_capacity; float32 percentage; uint8 power_supply_status;"
        " uint8 power_supply_health; uint8 power_supply_technology; bool present;"
        " float32[] cell_voltage; float32[] cell_temperature; string location;"
        " string serial_number"
    ),
    "sensor_msgs/CompressedImage": (
        "std_msgs/Header header; string format; uint8[] data"
    ),
    "sensor_msgs/PointField": (
        "string name; uint32 offset; uint8 datatype; uint32 count"
    ),
    "sensor_msgs/PointCloud2": (
        "std_msgs/Header header; uint32 height; uint32 width;"
        " sensor_msgs/PointField[] fields; bool is_bigendian; uint32 point_step;"
        " uint32 row_step; uint8[] data; bool is_dense"
    ),
    "sensor_msgs/Range": (
        "std_msgs/Header header; uint8 radiation_type; float32 field_of_view;"
        " float32 min_range; float32 max_range; float32 range"
    ),
    "sensor_msgs/NavSatStatus": "int8 status; uint16 service",
    "sensor_msgs/NavSatFix": (
        "std_msgs/Header header; sensor_msgs/NavSatStatus status; float64 latitude;"
        " float64 longitude; float64 altitude; float64[9] position_covariance;"
        " uint8 position_covariance_type"
    ),
    "map_msgs/OccupancyGridUpdate": (
        "std_msgs/Header header; int32 x; int32 y; uint32 width; uint32 height;"
        " int8[] data"
    ),
    "visualization_msgs/Marker": (
        "std_msgs/Header header; string ns; int32 id; int32 type; int32 action;"
        " geometry_msgs/Pose pose; geometry_msgs/Vector3 scale;"
        " std_msgs/ColorRGBA color; duration lifetime; bool frame_locked;"
        " geometry_msgs/Point[] points; std_msgs/ColorRGBA[] colors; string text;"
        " string mesh_resource; bool mesh_use_embedded_materials"
    ),
    "visualization_msgs/MarkerArray": "visualization_msgs/Marker[] markers",
    "diagnostic_msgs/KeyValue": "string key; string value",
    "diagnostic_msgs/DiagnosticStatus": (
        "uint8 level; string name; string message; string hardware_id;"
        " diagnostic_msgs/KeyValue[] values"
    ),
    "diagnostic_msgs/DiagnosticArray": (
        "std_msgs/Header header; diagnostic_msgs/DiagnosticStatus[] status"
    ),
    "rosgraph_msgs/Log": (
        "std_msgs/Header header; uint8 level; string name; string msg; string file;"
        " string function; uint32 line; string[] topics"
    ),
    "rcl_interfaces/Log": (
        "time stamp; uint8 level; string name; string msg; string file;"
        " string function; uint32 line"
    ),
    "actionlib_msgs/GoalID": "time stamp; string id",
    "actionlib_msgs/GoalStatus": (
        "actionlib_msgs/GoalID goal_id; uint8 status; string text"
    ),
    "actionlib_msgs/GoalStatusArray": (
        "std_msgs/Header header; actionlib_msgs/GoalStatus[] status_list"
    ),
    "move_base_msgs/MoveBaseGoal": "geometry_msgs/PoseStamped target_pose",
    "move_base_msgs/MoveBaseFeedback": "geometry_msgs/PoseStamped base_position",
    "move_base_msgs/MoveBaseResult": "",
    "move_base_msgs/MoveBaseActionGoal": (
        "std_msgs/Header header; actionlib_msgs/GoalID goal_id;"
        " move_base_msgs/MoveBaseGoal goal"
    ),
    "move_base_msgs/MoveBaseActionFeedback": (
        "std_msgs/Header header; actionlib_msgs/GoalStatus status;"
        " move_base_msgs/MoveBaseFeedback feedback"
    ),
    "move_base_msgs/MoveBaseActionResult": (
        "std_msgs/Header header; actionlib_msgs/GoalStatus status;"
        " move_base_msgs/MoveBaseResult result"
    ),
    "unique_identifier_msgs/UUID": "uint8[16] uuid",
    "action_msgs/GoalInfo": "unique_identifier_msgs/UUID goal_id; time stamp",
    "action_msgs/GoalStatus": "action_msgs/GoalInfo goal_info; int8 status",
    "action_msgs/GoalStatusArray": "action_msgs/GoalStatus[] status_list",
    "nav2_msgs/NavigateToPose_Goal": (
        "geometry_msgs/PoseStamped pose; string behavior_tree"
    ),
    "nav2_msgs/NavigateToPose_Result": "uint16 error_code; string error_msg",
    "nav2_msgs/NavigateToPose_Feedback": (
        "geometry_msgs/PoseStamped current_pose; duration navigation_time;"
        " duration estimated_time_remaining; int16 number_of_recoveries;"
        " float32 distance_remaining"
    ),
    "nav2_msgs/NavigateToPose_FeedbackMessage": (
        "unique_identifier_msgs/UUID goal_id;"
        " nav2_msgs/NavigateToPose_Feedback feedback"
    ),
    "rosapi/TypeDef": (
        "string type; string[] fieldnames; string[] fieldtypes;"
        " int32[] fieldarraylen; string[] examples; string[] constnames;"
        " string[] constvalues"
    ),
}

SERVICES = {
    "std_srvs/Trigger": ("", "bool success; string message"),
    "std_srvs/Empty": ("", ""),
    "std_srvs/SetBool": ("bool data", "bool success; string message"),
    "action_msgs/CancelGoal": (
        "action_msgs/GoalInfo goal_info",
        "int8 return_code; action_msgs/GoalInfo[] goals_canceling",
    ),
    "rosapi/Topics": ("", "string[] topics; string[] types"),
    "rosapi/TopicsForType": ("string type", "string[] topics"),
    "rosapi/TopicsAndRawTypes": (
        "",
        "string[] topics; string[] types; string[] typedefs_full_text",
    ),
    "rosapi/TopicType": ("string topic", "string type"),
    "rosapi/Services": ("", "string[] services"),
    "rosapi/ServicesForType": ("string type", "string[] services"),
    "rosapi/ServiceType": ("string service", "string type"),
    "rosapi/ServiceProviders": ("string service", "string[] providers"),
    "rosapi/ServiceRequestDetails": ("string type", "rosapi/TypeDef[] typedefs"),
    "rosapi/ServiceResponseDetails": ("string type", "rosapi/TypeDef[] typedefs"),
    "rosapi/Publishers": ("string topic", "string[] publishers"),
    "rosapi/Subscribers": ("string topic", "string[] subscribers"),
    "rosapi/Nodes": ("", "string[] nodes"),
    "rosapi/NodeDetails": (
        "string node",
        "string[] subscribing; string[] publishing; string[] services",
    ),
    "rosapi/MessageDetails": ("string type", "rosapi/TypeDef[] typedefs"),
    "rosapi/GetActionServers": ("", "string[] action_servers"),
    "rosapi/GetTime": ("", "time time"),
    "rosapi/GetParam": ("string name; string default", "string value"),
    "rosapi/GetParamNames": ("", "string[] names"),
    "rosapi/GetROSVersion": ("", "uint8 version; string distro"),
}
