#include "mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace youbot_base_sim {

namespace {

/// Lengths below a nanometre are rounding errors.
double rounded(double x) { return std::abs(x) < 1e-9 ? 0.0 : x; }

/// A list of vectors, to six digits: a thousandth of a millimetre on a robot of a metre.
template <class VectorOf>
std::string source(const char* id, std::size_t count, const VectorOf& vector_of) {
  std::string text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "<source id=\"{}\"><float_array id=\"{}_array\" count=\"{}\">\n", id, id, 3 * count);
  for (std::size_t k = 0; k < count; ++k) {
    const Eigen::Vector3d v = vector_of(k);
    fmt::format_to(out, "{:.6g} {:.6g} {:.6g}\n", rounded(v.x()), rounded(v.y()), rounded(v.z()));
  }
  fmt::format_to(
      out,
      "</float_array><technique_common><accessor source=\"#{}_array\" count=\"{}\" stride=\"3\">"
      "<param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/>"
      "</accessor></technique_common></source>\n",
      id, count);
  return text;
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
  const auto at = [&](int k) -> const Vertex& { return vertices_[face[k]]; };
  const Eigen::Vector3d turn = (at(2).position - at(0).position).cross(at(3).position - at(1).position);
  if (turn.dot(at(0).normal + at(1).normal + at(2).normal + at(3).normal) < 0) std::reverse(face.begin(), face.end());
  add_triangle(colour, {face[0], face[1], face[2]});
  add_triangle(colour, {face[0], face[2], face[3]});
}

void Mesh::add_triangle(const Colour& colour, const std::array<int, 3>& triangle) {
  const auto at = [&](int k) -> const Eigen::Vector3d& { return vertices_[triangle[k]].position; };
  if (at(0) == at(1) || at(1) == at(2) || at(2) == at(0)) return;
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
         "</library_materials>\n<library_geometries><geometry id=\"mesh\"><mesh>\n" +
         source("positions", vertices_.size(), [&](std::size_t k) { return vertices_[k].position; }) +
         source("normals", vertices_.size(), [&](std::size_t k) { return vertices_[k].normal; }) +
         "<vertices id=\"vertices\"><input semantic=\"POSITION\" source=\"#positions\"/></vertices>\n" + triangles +
         "</mesh></geometry></library_geometries>\n"
         "<library_visual_scenes><visual_scene id=\"scene\"><node><instance_geometry url=\"#mesh\"><bind_material>"
         "<technique_common>" +
         bindings +
         "</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>\n"
         "<scene><instance_visual_scene url=\"#scene\"/></scene>\n</COLLADA>\n";
}

}  // namespace youbot_base_sim
