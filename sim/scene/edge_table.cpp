#include <fmt/format.h>

#include "sim/scene/scene_table.h"

namespace touchfield::schema {

namespace {

Codec<EdgeSpec> graded_codec() {
  using Edges = EdgeSpec;
  const auto length = number(kMillimetres, above(0));
  return Map<Edges>()
      .required("far", &Edges::far, length, "3", "Edge length where no shorter one is requested [mm].")
      .maybe("near_target", &Edges::near_target, length, "1.2", "Edge length near the centre of every target box [mm].")
      .key("near", &Edges::near, table_of(length), "Edge length near landmarks of this body [mm].")
      .shown_as("{thumb_pad: 1.2}")
      .key("within_mm", &Edges::within, number(kMillimetres, {.low = 0.0, .high = {}}),
           "Distance from these places within which their edge length applies [mm].")
      .key("growth", &Edges::growth, number(kPlain, between(0.02, 0.6)),
           "Growth of the edge length beyond that distance, per distance.")
      .check([](const Input& in, Edges& edges, bool good) {
        if (!good || edges.graded()) {
          return good;
        }
        return in.problem("must have near_target or near in addition to far");
      })
      .codec();
}

}  // namespace

Codec<EdgeSpec> edge_codec() {
  const auto uniform = kept_in(&EdgeSpec::far, number(kMillimetres, above(0)));
  return either<EdgeSpec>(
      uniform, graded_codec(), [](const EdgeSpec& edges) { return !edges.graded(); },
      [](const Node& node) { return node.kind != Node::Kind::kMap; });
}

bool check_hand_edges(const Input& edges) {
  const auto check = [](const Input& edge) {
    const auto rule = kHandEdge.broken_by(*parse_decimal(edge.node().text));
    if (rule) {
      edge.must_be(*rule + " for a hand");
    }
    return !rule;
  };
  if (edges.node().kind != Node::Kind::kMap) {
    return check(edges);
  }
  bool good = true;
  for (const char* key : {"far", "near_target"}) {
    const Entry* entry = edges.node().find(key);
    good = (!entry || check(edges.at(*entry))) && good;
  }
  if (const Entry* near = edges.node().find("near")) {
    for (const Entry& entry : near->value.entries) {
      if (!entry.value.removed) {
        good = check(edges.at(*near).at(entry)) && good;
      }
    }
  }
  return good;
}

}  // namespace touchfield::schema
