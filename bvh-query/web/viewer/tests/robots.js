/** Small robots for the tests of the page, as URDF. */

const block = (sides, origin = "") => `<collision>${origin}<geometry><box size="${sides}"/></geometry></collision>`;

/** Joints of all kinds, one that mimics another one, links of two shapes, and one that a fixed joint carries. */
export const allKinds = `<robot name="all">
  <link name="root">${block("0.5 0.5 0.1")}</link>
  <link name="a">${block("0.2 0.3 0.4", '<origin xyz="0.1 0 0.2" rpy="0.2 0.4 -0.3"/>')}${block("0.1 0.1 0.9")}</link>
  <link name="b">${block("0.3 0.1 0.1")}</link>
  <link name="c">${block("0.2 0.2 0.2")}</link>
  <link name="d">${block("0.1 0.6 0.1", '<origin xyz="0 0.3 0"/>')}</link>
  <link name="e">${block("0.4 0.2 0.2")}</link>
  <link name="f">${block("0.3 0.3 0.1")}${block("0.1 0.1 0.5")}</link>
  <joint name="turn" type="revolute">
    <parent link="root"/><child link="a"/><origin xyz="1 2 3" rpy="0.3 -0.4 0.5"/><axis xyz="0 3 4"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
  <joint name="fixed" type="fixed"><parent link="a"/><child link="b"/><origin xyz="0 0 1" rpy="1 0 0"/></joint>
  <joint name="slide" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 0 2"/></joint>
  <joint name="follow" type="continuous">
    <parent link="c"/><child link="d"/><origin xyz="0 1 0"/><mimic joint="turn" multiplier="-2" offset="0.25"/>
  </joint>
  <joint name="plane" type="planar"><parent link="root"/><child link="e"/><origin rpy="0 0 0.7"/></joint>
  <joint name="free" type="floating"><parent link="e"/><child link="f"/><origin xyz="0.1 0 0"/></joint>
</robot>`;

/** Values of its joints: turn, slide, plane (3) and free (7). */
export const configurations = [
    [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1],
    [0.6, -0.7, 1.2, 0.3, 1.1, 0.4, 0.5, 0.6, 0, 0.6, 0, 0.8],
    [-1, 0.25, -2, 4, -3, 0, -1, 2, 0.5, -0.5, 0.5, -0.5],
    [0.9, 3, 0.5, 0.5, 0.1, 0, 0, 0.3, 1.5, 2, -0.5, 0.1],
];

/** An arm that turns about z, from 1 to 2 from the axis and 0.25 thick; and a cart of two halves, a cube of side 0.5 that slides along x. */
export const armAndCart = `<robot name="two">
  <link name="base"/>
  <link name="arm">${block("1 0.25 0.25", '<origin xyz="1.5 0 0"/>')}</link>
  <link name="cart">
    ${block("0.5 0.25 0.5", '<origin xyz="0 0.125 0"/>')}${block("0.5 0.25 0.5", '<origin xyz="0 -0.125 0"/>')}
  </link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="1 0 0"/>
    <limit lower="-9" upper="9" effort="1" velocity="1"/></joint>
</robot>`;
