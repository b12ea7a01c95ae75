#pragma once

namespace porthos::test {

/// A rod that hangs from the world on a hinge, as URDF.
inline constexpr const char* pendulum = R"(<robot name="pendulum">
  <link name="world"/>
  <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
    <inertia ixx="0.2" iyy="0.2" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="1 0 0"/></joint>
</robot>)";

}  // namespace porthos::test
