#include <algorithm>
#include <map>
#include <tuple>

#include <fmt/format.h>

#include "sim/bem/scheme.h"
#include "sim/scene/number_files.h"
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

/// The schemes of the boundary elements.
Codec<Scheme> scheme_codec() {
  std::vector<std::pair<std::string, Scheme>> names;
  for (const Scheme scheme : all_schemes()) {
    names.emplace_back(to_string(scheme), scheme);
  }
  return choice<Scheme>(std::move(names));
}

Codec<int> iterations_codec() { return integer(between(1, 100000)); }

Codec<StartSpec> make_start_codec() {
  using Kind = StartSpec::Kind;
  const auto is_random = [](const StartSpec& start) { return start.kind == Kind::kRandom; };
  const auto named = kept_in(
      &StartSpec::kind,
      choice<Kind>(
          {{"auto", Kind::kAuto}, {"zero", Kind::kZero}, {"adjoint", Kind::kAdjoint}, {"spectral", Kind::kSpectral}}));
  const auto detailed =
      Map<StartSpec>()
          .maybe("random", &StartSpec::seed, seed(), "1", "Phases drawn at random from this seed.")
          .written_if(is_random)
          .maybe("restarts", &StartSpec::restarts, integer(between(1, 1000)), "1",
                 "Number of starts, with this seed and the following ones; the solution of least cost is kept.")
          .written_if([](const StartSpec& start) { return start.restarts != 1; })
          .allowed_with({"random"})
          .maybe("previous", &StartSpec::file, absolute_file(), "before/run.h5",
                 "The phases of a run, from its run.h5.")
          .maybe("method", &StartSpec::method, name(), "surface",
                 "Method of these phases. Default: the method of the same name, otherwise the first of the run.")
          .allowed_with({"previous"})
          .maybe("among", &StartSpec::among, flag(), "true",
                 "Whether auto tries these phases as one of several starts. Otherwise they are the only start. For "
                 "surface only.")
          .written_if([](const StartSpec& start) { return start.among; })
          .allowed_with({"previous"})
          .exactly_one({"random", "previous"})
          .check([](const Input& in, StartSpec& start, bool good) {
            start.kind = in.node().find("random") ? Kind::kRandom : Kind::kPrevious;
            return good;
          })
          .codec();
  return either<StartSpec>(named, detailed,
                           [=](const StartSpec& start) { return !is_random(start) && start.kind != Kind::kPrevious; });
}

// One for all that start somewhere: the pages describe it once.
const Codec<StartSpec>& start_codec() {
  static const Codec<StartSpec> codec = make_start_codec();
  return codec;
}

std::string name_of(const MethodSpec& method) {
  return method.name.empty() ? std::string(method.kind->name) : method.name;
}

bool is_scalar(const Node& node) { return node.kind == Node::Kind::kScalar; }

Codec<std::vector<double>> channel_values(const Codec<double>& value) {
  using List = std::vector<double>;
  const auto for_all = kept_as<List, double>(
      value, [](const Input&, const double& given) { return std::optional(List{given}); },
      [](const List& values) { return values.front(); });
  return either<List>(
      for_all, list_of(value, 1, kMostListed), [](const List& values) { return values.size() == 1; }, is_scalar);
}

void add_fixed_drives(Map<MethodSpec>& map) {
  const auto from_file = kept_as<std::vector<double>, std::string>(
      file(),
      [](const Input& in, const std::string& path) { return read_named(in, [&] { return read_phases(path); }); },
      nullptr);
  map.maybe("phases_rad", &MethodSpec::phases, channel_values(number(kPlain, {})), "0",
            "The phases [rad]: one for all channels, or one per channel.")
      .maybe("phases_file", &MethodSpec::phases, from_file, "phases.txt",
             "A text file of the phases [rad], separated by commas or white space; # starts a comment.")
      .exactly_one({"phases_rad", "phases_file"})
      .key("amplitudes", &MethodSpec::amplitudes, channel_values(number(kPlain, between(0, 1))),
           "The amplitudes: one for all channels, or one per channel.");
}

bool weighs_faces(const PhaseMethod& kind) {
  return kind.model == MethodModel::kScattered || kind.model == MethodModel::kFree;
}

Codec<ChannelTolerances> tolerances_codec() {
  const Unit percent = Unit::power_of_ten(-2);
  return Map<ChannelTolerances>()
      .key("phase_deg", &ChannelTolerances::phase, number(kDegrees, between(0, 180)),
           "Standard deviation of the phases [deg].")
      .key("gain_percent", &ChannelTolerances::gain, number(percent, between(0, 100)),
           "Standard deviation of the gains [%].")
      .key("dead_percent", &ChannelTolerances::dead, number(percent, between(0, 90)),
           "Probability that a channel is dead [%]; nobody knows which.")
      .codec();
}

Codec<MethodSpec> make_options_codec(const PhaseMethod& kind) {
  Map<MethodSpec> map;
  map.maybe("as", &MethodSpec::name, name(), "second_try",
            "Name of the method in the results; default: the method's own.")
      .maybe("scheme", &MethodSpec::scheme, scheme_codec(), "paper", "Scheme of this method instead of solve.scheme.");
  if (kind.iterates) {
    map.maybe("iterations", &MethodSpec::iterations, iterations_codec(), "10",
              "Iterations of this method, instead of solve.iterations.")
        .maybe("start", &MethodSpec::start, start_codec(), "{random: 7}",
               "Start of this method, instead of solve.start.");
  }
  if (kind.free_amplitudes) {
    map.key("free_amplitudes", &MethodSpec::free_amplitudes, flag(),
            "Whether the amplitudes of the transducers are found too, from 0 to 1, or are all the same.")
        .key("free_level", &MethodSpec::free_level, flag(),
             "Whether the common amplitude is found too, if the array is too strong for the wanted pressure, or is 1. "
             "Boards that switch transducers only on and off need false.")
        .maybe("tolerances", &MethodSpec::tolerances, tolerances_codec(), "{phase_deg: 20, gain_percent: 10}",
               "How far the channels of the real array may be from their design, all independent of each other. The "
               "expected misfit is then minimised, over the phases and the common amplitude. Only for stills.");
  }
  if (kind.radiation) {
    map.key("outside_weight", &MethodSpec::outside_weight, number(kPlain, {.low = 0.0, .high = {}}),
            "Weight of sound on the skin outside the target. More of it leaves less pressure there, and presses less "
            "and more narrowly inside.");
  }
  if (weighs_faces(kind)) {
    map.key("faces", &MethodSpec::faces,
            choice<FaceWeights>({{"equal", FaceWeights::kEqual}, {"area", FaceWeights::kArea}}),
            "Weight of the faces in the misfit. equal: as published, so that a finely meshed patch counts more. area: "
            "their area, as in surface.");
  }
  if (kind.model == MethodModel::kGiven) {
    add_fixed_drives(map);
  }
  return map.codec();
}

// Methods with the same options share their table: the pages describe it once.
const Codec<MethodSpec>& options_codec(const PhaseMethod& kind) {
  static std::map<std::tuple<bool, bool, bool, bool, bool>, Codec<MethodSpec>> tables;
  const std::tuple options(kind.iterates, kind.free_amplitudes, kind.radiation, kind.model == MethodModel::kGiven,
                           weighs_faces(kind));
  const auto found = tables.find(options);
  return found != tables.end() ? found->second : tables.emplace(options, make_options_codec(kind)).first->second;
}

Codec<MethodSpec> method_codec() {
  Map<MethodSpec> map;
  std::vector<std::string> words;
  for (const PhaseMethod& kind : phase_methods()) {
    const std::string text(kind.name);
    const auto& options = options_codec(kind);
    map.add(
        {.name = text, .type = options.type, .help = std::string(kind.help)},
        [options, &kind](const Input& in, MethodSpec& form) {
          form.kind = &kind;
          return options.read(in, form);
        },
        [options, &kind](const MethodSpec& form) {
          return form.kind == &kind ? std::optional<Node>(options.write(form)) : std::nullopt;
        });
    words.push_back(text);
  }
  const auto with_options = map.exactly_one(words).codec();
  // A bare name is that method without options.
  const auto bare = kept_as<MethodSpec, std::string>(
      word(words),
      [with_options](const Input& in, const std::string& text) {
        Node options = schema::map({});
        options.place = in.node().place;
        Node spelt_out = schema::map({{text, options}});
        spelt_out.place = in.node().place;
        MethodSpec method;
        return with_options.read({spelt_out, in.path(), in.reading()}, method) ? std::optional(method) : std::nullopt;
      },
      nullptr);
  return either<MethodSpec>(
      bare, with_options, [](const MethodSpec&) { return false; }, is_scalar);
}

Codec<ComputeDevice> device_codec() {
  return kept_as<ComputeDevice, std::string>(
      text(1),
      [](const Input& in, const std::string& given) {
        const auto choice = compute_device(given);
        if (!choice) {
          in.must_be("auto, cpu, cuda or cuda:N, where N is the number of a card, from 0");
        }
        return choice;
      },
      [](const ComputeDevice& choice) { return to_string(choice); });
}

Map<SolverSpec> solver_keys() {
  return Map<SolverSpec>()
      .key("device", &SolverSpec::device, device_codec(),
           "Device that computes: cpu, cuda (a graphics card; cuda:1 is the second one), or auto (the card, if there "
           "is one and it is faster).")
      .key("solver", &SolverSpec::solver,
           choice<SolverChoice>({{"auto", SolverChoice::kAuto},
                                 {"lu", SolverChoice::kLu},
                                 {"gmres", SolverChoice::kGmres},
                                 {"matrix_free", SolverChoice::kMatrixFree},
                                 {"fft", SolverChoice::kFft}}),
           "Solver of the equations. lu: dense LU. gmres: GMRES with a stored matrix. matrix_free: GMRES that computes "
           "the matrix again in every step. fft: GMRES with products by a grid and Fourier transforms. auto: chosen by "
           "size.")
      .key("precision", &SolverSpec::precision,
           choice<PrecisionChoice>({{"auto", PrecisionChoice::kAuto},
                                    {"double", PrecisionChoice::kDouble},
                                    {"single", PrecisionChoice::kSingle}}),
           "Precision in which the matrix is computed and solved.")
      .key("tolerance", &SolverSpec::tolerance, number(kPlain, between(1e-13, 0.1)),
           "Largest residual of a solution, relative to its right-hand side.")
      .key("refine", &SolverSpec::refine, flag(),
           "Whether a solution in single precision is refined until its residual, computed in double, meets the "
           "tolerance.")
      .key("max_steps", &SolverSpec::max_steps, integer(between(1, 10000)), "Largest number of GMRES steps.")
      .key("resonance_check", &SolverSpec::resonance_check,
           choice<ResonanceCheck>({{"auto", ResonanceCheck::kAuto},
                                   {"always", ResonanceCheck::kAlways},
                                   {"never", ResonanceCheck::kNever}}),
           "Resonance check: compares the pressures with and without the Burton-Miller terms and warns if they differ "
           "much; auto: if both are cheap.")
      .key("coupling", &SolverSpec::coupling, number(kPlain, between(0.01, 10)),
           "Weight of the derivative equation of Burton-Miller, in units of i/k.")
      .key("split_ratio", &SolverSpec::split_ratio, number(kPlain, between(0.5, 4)),
           "A face is split into four while it is nearer to the point than this many times the square root of its "
           "area. Its pieces are split likewise.");
}

/// Starts that only methods on the skin can have, or only those that try several.
bool check_start(const Input& in, const MethodSpec& method) {
  if (method.start.among && method.kind->iterates && !method.kind->searches) {
    return in.problem(fmt::format("{} takes one start; give it another start, or leave among out", method.name));
  }
  const bool incident = method.kind->iterates && method.kind->model != MethodModel::kSkin;
  const bool adjoint = method.start.kind == StartSpec::Kind::kAdjoint;
  if (!incident || (!adjoint && method.start.kind != StartSpec::Kind::kSpectral)) {
    return true;
  }
  return in.problem(
      fmt::format("{} cannot start from {}; give it another start", method.name, adjoint ? "adjoint" : "spectral"));
}

/// Fills in what methods leave to `solve`.
bool complete_methods(const Input& in, SolveSpec& solve, bool good) {
  for (std::size_t i = 0; good && i < solve.methods.size(); ++i) {
    MethodSpec& method = solve.methods[i];
    const Entry* entry = in.node().find("methods")->value.items[i].find(method.kind->name);
    const auto says = [&](const char* key) { return entry != nullptr && entry->value.find(key) != nullptr; };
    method.name = name_of(method);
    method.scheme = says("scheme") ? method.scheme : solve.scheme;
    const bool usual = method.kind->iterations == kUsualIterations;
    method.iterations = says("iterations") ? method.iterations : usual ? solve.iterations : method.kind->iterations;
    method.start = says("start") ? method.start : solve.start;
    good = check_start(in, method);
  }
  return good;
}

Codec<EvaluationSpec> own_model_codec() {
  return Map<EvaluationSpec>()
      .key("scheme", &EvaluationSpec::scheme, scheme_codec(), "Scheme of the evaluation mesh.")
      .maybe(
          "edge_mm", &EvaluationSpec::edge, edge_codec(), "1.4",
          fmt::format("Edge length of an evaluation mesh [mm], as edge_mm of a body; for a hand {}.", kHandEdge.text()))
      .written_if([](const EvaluationSpec& evaluation) { return evaluation.kind == EvaluationSpec::Kind::kEdge; })
      .maybe("split", &EvaluationSpec::splits, integer(between(1, 2)), "1",
             "The solving mesh, with every face split into four this many times; instead of edge_mm.")
      .exactly_one({"edge_mm", "split"})
      .check([](const Input& in, EvaluationSpec& evaluation, bool good) {
        if (good) {
          evaluation.kind = in.node().find("edge_mm") ? EvaluationSpec::Kind::kEdge : EvaluationSpec::Kind::kSplit;
        }
        return good;
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
    const double length = *parse_decimal(edge.node().text);
    const auto rule = kHandEdge.broken_by(length);
    if (rule) {
      edge.must_be(*rule + " for a hand" + other_unit("edge_mm", length, kHandEdge));
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

Codec<SolveSpec> solve_codec() {
  return Map<SolveSpec>()
      .required("methods", &SolveSpec::methods,
                list_of<MethodSpec>(method_codec(), 1, kMostItems,
                                    {.name = name_of, .advice = "; another name is given with as"}),
                "[surface, paper, unscattered, focus]", "Methods to compare, each a name or {name: {options}}.")
      .key("scheme", &SolveSpec::scheme, scheme_codec(),
           "Scheme of the boundary elements. paper: as published. paper_corrected: with a better diagonal. chief: "
           "also with points inside the body. burton_miller: also with the derivative of the pressure. "
           "burton_miller_polished: the same, and then two steps of paper_corrected.")
      .key("iterations", &SolveSpec::iterations, iterations_codec(),
           fmt::format("Number of iterations of an iterative method, but for radiation, which takes up to {} steps.",
                       kUsualDescents))
      .key("start", &SolveSpec::start, start_codec(),
           "First phases of an iterative method. auto: surface takes some steps from each of several starts and "
           "continues from the best; other methods start from zero. paper and unscattered do not take adjoint and "
           "spectral.")
      .key("outside_weight", &SolveSpec::outside_weight, number(kPlain, {.low = 0.0, .high = {}}),
           "Weight of the pressure on the skin outside the target, for surface and lbfgs; radiation has its own.")
      .key("optimality_bound", &SolveSpec::optimality_bound, flag(),
           "Whether the optimality bound is computed: a lower bound of the cost of surface, and the gap of each "
           "method to it; of radiation that of its own cost.")
      .key("allow_coarse_mesh", &SolveSpec::allow_coarse_mesh, flag(),
           "Whether a mesh with fewer than 1.5 edges per wavelength near the target is solved anyway. Otherwise it "
           "is an error, because pressures there are meaningless.")
      .part(&SolveSpec::solver, solver_keys())
      .check(complete_methods)
      .codec();
}

Codec<EvaluationSpec> evaluation_codec() {
  const auto bare =
      kept_in(&EvaluationSpec::kind, choice<EvaluationSpec::Kind>({{"auto", EvaluationSpec::Kind::kAuto},
                                                                   {"same", EvaluationSpec::Kind::kSame},
                                                                   {"none", EvaluationSpec::Kind::kNone}}));
  return either<EvaluationSpec>(bare, own_model_codec(), [](const EvaluationSpec& evaluation) {
    return evaluation.kind != EvaluationSpec::Kind::kEdge && evaluation.kind != EvaluationSpec::Kind::kSplit;
  });
}

bool check_evaluation(const Input& in, const Scene& scene) {
  const Entry* entry = in.node().find("evaluation");
  if (entry && scene.evaluation.kind == EvaluationSpec::Kind::kNone && solver_mistakes_channels(scene.array)) {
    return in.at(*entry).problem(
        "none, but the solver does not know the true responses of the channels: the scene must have an evaluation");
  }
  if (!entry || entry->value.kind != Node::Kind::kMap) {
    return true;
  }
  const Input evaluation = in.at(*entry);
  bool good = true;
  if (scene.evaluation.kind == EvaluationSpec::Kind::kEdge && !scene.bodies.empty()) {
    good = check_near(evaluation.key("edge_mm"), landmark_names(scene.bodies)) && good;
  }
  const bool any_hand = std::any_of(scene.bodies.begin(), scene.bodies.end(),
                                    [](const BodySpec& body) { return std::holds_alternative<HandShape>(body.shape); });
  if (scene.evaluation.kind == EvaluationSpec::Kind::kEdge && any_hand) {
    good = check_hand_edges(evaluation.key("edge_mm")) && good;
  }
  return good;
}

}  // namespace touchfield::schema
