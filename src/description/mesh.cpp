#include "mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace youbot_base_sim {

namespace {

/// Lengths below a nanometre are rounding errors.
double rounded(double x) { return std::abs(x) < 1e-9 ? 0.0 : x; }

/// A list of vectors, to six digits: a thousandth of a millimetre on a robot of a metre.
std::string source(const char* id, const std::vector<Eigen::Vector3d>& vectors) {
  std::string numbers;
  for (const Eigen::Vector3d& v : vectors) {
    numbers += fmt::format("{:.6g} {:.6g} {:.6g}\n", rounded(v.x()), rounded(v.y()), rounded(v.z()));
  }
  return fmt::format(
      "<source id=\"{0}\"><float_array id=\"{0}_array\" count=\"{1}\">\n{2}"
      "</float_array><technique_common><accessor source=\"#{0}_array\" count=\"{3}\" stride=\"3\">"
      "<param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/>"
      "</accessor></technique_common></source>\n",
      id, 3 * vectors.size(), numbers, vectors.size());
}

std::string effect(std::size_t k, const Colour& colour) {
  return fmt::format(
      "<effect id=\"effect_{}\"><profile_COMMON><technique sid=\"common\"><phong>"
      "<ambient><color>{:g} {:g} {:g} 1</color></ambient><diffuse><color>{:g} {:g} {:g} 1</color></diffuse>"
      "<specular><color>0.2 0.2 0.2 1</color></specular><shininess><float>20</float></shininess>"
      "</phong></technique></profile_COMMON></effect>\n",
      k, 0.6 * colour[0], 0.6 * colour[1], 0.6 * colour[2], colour[0], colour[1], colour[2]);
}

}  // namespace

/// Turns the face so that its corners run counter-clockwise, seen from outside.
void Mesh::add_face(const Colour& colour, std::array<int, 4> face) {
  const auto [a, b, c, d] = face;
  const Eigen::Vector3d turn = (positions_[c] - positions_[a]).cross(positions_[d] - positions_[b]);
  if (turn.dot(normals_[a] + normals_[b] + normals_[c] + normals_[d]) < 0) std::reverse(face.begin(), face.end());
  add_triangle(colour, {face[0], face[1], face[2]});
  add_triangle(colour, {face[0], face[2], face[3]});
}

void Mesh::add_triangle(const Colour& colour, const std::array<int, 3>& triangle) {
  const auto [a, b, c] = triangle;
  if (positions_[a] == positions_[b] || positions_[b] == positions_[c] || positions_[c] == positions_[a]) return;
  auto paint = std::find_if(paints_.begin(), paints_.end(), [&](const Paint& p) { return p.colour == colour; });
  if (paint == paints_.end()) paint = paints_.insert(paint, {colour, {}});
  paint->triangles.push_back(triangle);
}

std::string Mesh::collada() const {
  std::string effects, materials, triangles, bindings;
  for (std::size_t k = 0; k < paints_.size(); ++k) {
    effects += effect(k, paints_[k].colour);
    materials += fmt::format("<material id=\"material_{0}\"><instance_effect url=\"#effect_{0}\"/></material>\n", k);
    bindings += fmt::format("<instance_material symbol=\"paint_{0}\" target=\"#material_{0}\"/>", k);
    triangles += fmt::format(
        "<triangles material=\"paint_{}\" count=\"{}\"><input semantic=\"VERTEX\" source=\"#vertices\" offset=\"0\"/>"
        "<input semantic=\"NORMAL\" source=\"#normals\" offset=\"0\"/><p>\n",
        k, paints_[k].triangles.size());
    for (const auto& [a, b, c] : paints_[k].triangles) triangles += fmt::format("{} {} {}\n", a, b, c);
    triangles += "</p></triangles>\n";
  }
  return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
         "<!-- Written by describe_base. -->\n"
         "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n"
         "<asset><unit name=\"meter\" meter=\"1\"/><up_axis>Z_UP</up_axis></asset>\n"
         "<library_effects>\n" +
         effects + "</library_effects>\n<library_materials>\n" + materials +
         "</library_materials>\n<library_geometries><geometry id=\"mesh\"><mesh>\n" + source("positions", positions_) +
         source("normals", normals_) +
         "<vertices id=\"vertices\"><input semantic=\"POSITION\" source=\"#positions\"/></vertices>\n" + triangles +
         "</mesh></geometry></library_geometries>\n"
         "<library_visual_scenes><visual_scene id=\"scene\"><node><instance_geometry url=\"#mesh\"><bind_material>"
         "<technique_common>" +
         bindings +
         "</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>\n"
         "<scene><instance_visual_scene url=\"#scene\"/></scene>\n</COLLADA>\n";
}

}  // namespace youbot_base_sim
