#include "youbot_base_sim/sweep/family.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>
#include <utility>

#include "youbot_base_sim/scene/scene_value.h"
#include "youbot_base_sim/scene/yaml_file.h"
#include "youbot_base_sim/text/hash.h"
#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/text/text_file.h"

namespace youbot_base_sim {

namespace {

constexpr int kMaxCount = 1'000'000'000;
constexpr Range kAnyNumber{-1e15, 1e15, ""};
constexpr Range kPositive{1e-15, 1e15, ""};
constexpr double kMiddle = 0.5, kBetween = 0.381966;  // shares at which an axis is tried besides its ends

constexpr Named<Distribution::Kind> kSpacings[] = {{"linear", Distribution::Kind::kUniform},
                                                   {"logarithmic", Distribution::Kind::kLogUniform}};
constexpr Named<Sampling> kSamplings[] = {{"independent", Sampling::kIndependent},
                                          {"latin_hypercube", Sampling::kLatinHypercube},
                                          {"sobol", Sampling::kSobol}};

/// Reads the ends of a range, and finishes its section.
Distribution read_range(SceneValue s, Distribution::Kind kind) {
  const Range& allowed = kind == Distribution::Kind::kLogUniform ? kPositive : kAnyNumber;
  Distribution range{kind};
  s.required("from").number(range.min, allowed);
  const SceneValue end = s.required("to");
  end.number(range.max, allowed);
  if (end.given() && range.max <= range.min) end.refuse(fmt::format("more than from, {}", range.min));
  s.finish();
  return range;
}

void read_steps(SceneValue s, Axis& axis) {
  auto spacing = Distribution::Kind::kUniform;
  s["spacing"].choice(spacing, kSpacings);
  s.required("count").whole_number(axis.count, 2, kMaxCount);
  axis.range = read_range(std::move(s), spacing);
}

Distribution read_normal(SceneValue s) {
  Distribution normal{Distribution::Kind::kNormal, -kInfinity, kInfinity};
  s.required("mean").number(normal.mean, kAnyNumber);
  s.required("deviation").number(normal.deviation, kPositive);
  const SceneValue from = s["from"], to = s["to"];
  from.number(normal.min, kAnyNumber);
  to.number(normal.max, kAnyNumber);
  s.finish();
  if (normal.min > normal.mean) from.refuse(fmt::format("at most the mean, {}", normal.mean));
  if (normal.max < normal.mean) to.refuse(fmt::format("at least the mean, {}", normal.mean));
  if (normal.max <= normal.min) to.refuse(fmt::format("more than from, {}", normal.min));
  return normal;
}

/// An axis and where it stands, for messages.
struct ReadAxis {
  Axis axis;
  SceneValue key;
};

/// The axis of one entry of `axes`, or those that it puts together. `whole` is the list of entries.
std::vector<ReadAxis> read_entry(SceneValue s, const SceneValue& whole, bool in_group) {
  if (!in_group) {
    const SceneValue together = s["together"];
    if (together.given()) {
      s.finish();
      std::vector<ReadAxis> group;
      for (const SceneValue& section : together.sections()) {
        for (ReadAxis& axis : read_entry(section, together, true)) group.push_back(std::move(axis));
      }
      for (const ReadAxis& axis : group) {
        if (axis.axis.is_drawn()) axis.key.refuse("of an axis with values or a range: draws go together as they are");
        if (axis.axis.size() == group.front().axis.size()) continue;
        axis.key.refuse(fmt::format("of an axis with {} values, as the first of those together has; it has {}",
                                    group.front().axis.size(), axis.axis.size()));
      }
      return group;
    }
  }
  const SceneValue key = s["key"], values = s["values"], range = s["range"], uniform = s["uniform"],
                   log_uniform = s["log_uniform"], normal = s["normal"];
  Axis axis;
  key.text(axis.key, "a key of the scene such as floor.friction or initial.wheel_angles[0]");
  s.finish();
  if (!key.given()) whole.refuse("axes with a key each");
  if (values.given() + range.given() + uniform.given() + log_uniform.given() + normal.given() != 1) {
    key.refuse("beside exactly one of values, range, uniform, log_uniform, normal");
  }
  if (values.given()) axis.list = values.entries();
  if (range.given()) read_steps(range, axis);
  if (normal.given()) axis.range = read_normal(normal);
  if (uniform.given()) axis.range = read_range(uniform, Distribution::Kind::kUniform);
  if (log_uniform.given()) axis.range = read_range(log_uniform, Distribution::Kind::kLogUniform);
  return {{std::move(axis), key}};
}

/// True if the keys are the same or one leads into the other.
bool overlap(const std::string& a, const std::string& b) {
  if (a.size() > b.size()) return overlap(b, a);
  return b.compare(0, a.size(), a) == 0 && (b.size() == a.size() || b[a.size()] == '.' || b[a.size()] == '[');
}

void read_axes(const SceneValue& axes, Family& family) {
  std::vector<ReadAxis> all;
  std::vector<Axis> drawn;
  std::uint64_t grid_axes = 0;
  for (const SceneValue& section : axes.sections()) {
    std::vector<ReadAxis> entry = read_entry(section, axes, false);
    for (ReadAxis& axis : entry) {
      for (const ReadAxis& other : all) {
        if (!overlap(axis.axis.key, other.axis.key)) continue;
        axis.key.refuse(fmt::format("a key that no other axis sets; one sets {}", quote(other.axis.key)));
      }
      const bool is_drawn = axis.axis.is_drawn();
      axis.axis.number = is_drawn ? drawn.size() : grid_axes;
      all.push_back(axis);
      (is_drawn ? drawn : family.axes).push_back(axis.axis);
    }
    grid_axes += !entry.front().axis.is_drawn();
  }
  family.axes.insert(family.axes.end(), drawn.begin(), drawn.end());
}

void read_draws(const SceneValue& draws, const SceneValue& sampling, const SceneValue& seed, Family& family) {
  draws.whole_number(family.draws, 1, kMaxCount);
  sampling.choice(family.sampling, kSamplings);
  seed.whole_number(family.seed, 0, std::numeric_limits<int>::max());
  if (!family.has_draws()) {
    for (const SceneValue* value : {&draws, &sampling, &seed}) {
      if (value->given()) value->refuse("left out, for no axis is drawn");
    }
  } else if (!draws.given()) {
    draws.refuse(fmt::format("the number of runs at each point of the grid, a whole number from 1 to {}", kMaxCount));
  } else if (family.sampling == Sampling::kSobol && family.axes.back().number >= kMaxSobolAxes) {
    sampling.refuse(fmt::format("another one for more than {} axes that are drawn", kMaxSobolAxes));
  }
}

std::vector<Quantity> read_quantities(const SceneValue& value) {
  if (!value.given()) return quantities();
  std::vector<Quantity> wanted;
  const std::vector<std::string> names = value.entries();
  for (auto name = names.begin(); name != names.end(); ++name) {
    const auto quantity = std::find_if(quantities().begin(), quantities().end(),
                                       [&](const Quantity& candidate) { return *name == candidate.name; });
    if (quantity == quantities().end() || std::find(names.begin(), name, *name) != name) {
      std::vector<std::string> all;
      for (const Quantity& candidate : quantities()) all.push_back(candidate.name);
      value.refuse(fmt::format("a list of some of {}, each once", fmt::join(all, ", ")));
    }
    wanted.push_back(*quantity);
  }
  return wanted;
}

std::optional<Trajectories> read_trajectories(const SceneValue& value) {
  if (!value.given()) return std::nullopt;
  SceneValue s = value;
  Trajectories trajectories;
  s["format"].choice(trajectories.format, {"csv", "bag"});
  s["every"].whole_number(trajectories.every, 1, kMaxCount);
  s.finish();
  return trajectories;
}

/// The setting that the error names, among those of a refused scene; the k-th if the error names it or none.
SceneSetting blame(const SceneSettings& settings, std::size_t k, const std::string& error) {
  const auto named = [&](const SceneSetting& setting) {
    const bool in_list = setting.key.back() == ']';
    const std::string key = setting.key.substr(0, in_list ? setting.key.rfind('[') : std::string::npos);
    return error.find(": " + key) != std::string::npos;
  };
  const auto other = std::find_if(settings.begin(), settings.end(), named);
  return named(settings[k]) || other == settings.end() ? settings[k] : *other;
}

/// Reads scenes with each axis at its ends and in between, or at each listed value. Throws SceneError for a value that
/// is refused with all others in the middle, at their starts and at their ends. Notes tables and warnings.
void try_axes(Family& family) {
  std::set<std::string> tables;
  const auto refusal = [&](const SceneSettings& settings) -> std::string {
    try {
      const Scene scene = load_scene(family.scene, settings);
      require_drive(scene);
      tables.insert(scene.files.begin() + 1, scene.files.end());
      for (const std::string& text : warnings_of(scene)) family.warnings[text.substr(0, text.find(' '))] = text;
    } catch (const SceneError& error) {
      return error.what();
    }
    return "";
  };
  for (std::size_t k = 0; k < family.axes.size(); ++k) {
    const Axis& tried = family.axes[k];
    std::vector<double> shares = {kMinDraw, kBetween, kMaxDraw};
    if (!tried.list.empty()) shares.clear();
    const auto size = static_cast<double>(tried.list.size());
    while (shares.size() < tried.list.size()) shares.push_back((static_cast<double>(shares.size()) + 0.5) / size);
    for (const double share : shares) {
      const auto beside = [&](double share_of_others) {
        SceneSettings settings;
        for (const Axis& axis : family.axes) {
          const bool in_step = axis.is_drawn() == tried.is_drawn() && axis.number == tried.number;
          settings.push_back({axis.key, axis.value_at(in_step ? share : share_of_others)});
        }
        return settings;
      };
      const std::string error = refusal(beside(kMiddle));
      if (error.empty() || refusal(beside(kMinDraw)).empty() || refusal(beside(kMaxDraw)).empty()) continue;
      const SceneSetting blamed = blame(beside(kMiddle), k, error);
      const bool is_list = error.find(": must be a list of") != std::string::npos && blamed.key.back() != ']';
      throw SceneError(fmt::format(
          "{}: {} = {}: {}{}", quote_path(family.path), quote(blamed.key), quote(blamed.value), error,
          is_list ? fmt::format("; an axis over an entry has a key such as {}[0]", quote(blamed.key)) : ""));
    }
  }
  family.tables.assign(tables.begin(), tables.end());
}

/// True if axis k is in the grid and does not change together with the one before it.
bool begins_grid_axis(const Family& family, std::size_t k) {
  return !family.axes[k].is_drawn() && (k == 0 || family.axes[k].number != family.axes[k - 1].number);
}

/// A double, because there may be too many.
double number_of_runs(const Family& family) {
  double runs = family.draws;
  for (std::size_t k = 0; k < family.axes.size(); ++k) {
    if (begins_grid_axis(family, k)) runs *= static_cast<double>(family.axes[k].size());
  }
  return runs;
}

/// The scene file that the family names relative to its own folder.
SceneFile read_base_scene(const SceneValue& name, const std::string& family) {
  std::string scene;
  name.text(scene, "the name of a scene file");
  try {
    return read_scene_file(std::filesystem::path(family).parent_path() / scene);
  } catch (const SceneError& error) {
    name.refuse_for(error.what());
  }
}

Family read_family(const std::string& path, const std::string& text) {
  Family family;
  family.path = path;
  family.text = text;
  SceneValue file(quote_path(path), "", YAML::Load(text), "family");
  const SceneValue scene = file.required("scene"), axes = file.required("axes"), draws = file["draws"],
                   sampling = file["sampling"], seed = file["seed"], kept = file["quantities"],
                   trajectories = file["trajectories"];
  file.finish();
  read_axes(axes, family);
  read_draws(draws, sampling, seed, family);
  const double runs = number_of_runs(family);
  if (runs > Family::kMaxRuns) {
    (draws.given() ? draws : axes)
        .refuse(fmt::format("such that there are at most {:g} runs; there would be {:g}", Family::kMaxRuns, runs));
  }
  family.quantities = read_quantities(kept);
  family.trajectories = read_trajectories(trajectories);
  family.scene = read_base_scene(scene, path);
  try_axes(family);
  return family;
}

std::string name_of_file(const std::string& path) { return quote(std::filesystem::path(path).filename().string()); }

}  // namespace

std::string file_hash(const std::string& path) {
  try {
    return hash(read_text_file(path, std::numeric_limits<std::size_t>::max()));
  } catch (const UnreadableFile& error) {
    throw SceneError(fmt::format("{}: {}", quote_path(path), error.what()));
  }
}

std::uint64_t Axis::size() const { return list.empty() ? static_cast<std::uint64_t>(count) : list.size(); }

std::string Axis::value(std::uint64_t k) const {
  if (!list.empty()) return list[k];
  const double from = range.min, to = range.max;
  if (k == 0 || k + 1 == size()) return fmt::format("{}", k == 0 ? from : to);
  // Rounded, so that the second of 0.05, 0.06, .. is 0.06.
  const double share = static_cast<double>(k) / (count - 1);
  const bool logarithmic = range.kind == Distribution::Kind::kLogUniform;
  return fmt::format("{:.15g}", logarithmic ? from * std::pow(to / from, share) : from + share * (to - from));
}

std::string Axis::value_at(double share) const {
  if (is_drawn()) return fmt::format("{}", range.quantile(share));
  return value(std::min(static_cast<std::uint64_t>(share * static_cast<double>(size())), size() - 1));
}

std::string Axis::text() const {
  if (!list.empty()) return fmt::format("{}: {}", list.size(), quote(fmt::format("{}", fmt::join(list, ", "))));
  const std::string ends = fmt::format("from {} to {}", range.min, range.max);
  const bool logarithmic = range.kind == Distribution::Kind::kLogUniform;
  if (count > 0) return fmt::format("{} {}{}", count, ends, logarithmic ? ", logarithmic" : "");
  if (logarithmic) return "log-uniform " + ends;
  if (range.kind == Distribution::Kind::kUniform) return "uniform " + ends;
  return fmt::format("normal around {}, standard deviation {}, {}", range.mean, range.deviation, ends);
}

std::uint64_t Family::runs() const { return static_cast<std::uint64_t>(number_of_runs(*this)); }

double Family::share_of(const Axis& axis, std::uint64_t run) const {
  const auto a_point = static_cast<std::uint64_t>(draws), key = static_cast<std::uint64_t>(seed);
  if (sampling == Sampling::kLatinHypercube) return stratified_draw({key, axis.number, run}, runs());
  const DrawPlace place{key, axis.number, run % a_point, run / a_point};
  return sampling == Sampling::kSobol ? sobol_draw(place) : draw(place);
}

SceneSettings Family::settings(std::uint64_t run) const {
  SceneSettings settings(axes.size());
  std::uint64_t point = run / static_cast<std::uint64_t>(draws);  // of the grid that the axes up to k make
  for (std::size_t k = axes.size(); k-- > 0;) {
    const Axis& axis = axes[k];
    settings[k].key = axis.key;
    if (axis.is_drawn()) {
      settings[k].value = axis.value_at(share_of(axis, run));
    } else {
      settings[k].value = axis.value(point % axis.size());
      if (begins_grid_axis(*this, k)) point /= axis.size();
    }
  }
  return settings;
}

std::vector<std::string> Family::fingerprint() const {
  std::vector<std::string> lines = {fmt::format("{} build of sweep", file_hash("/proc/self/exe")),
                                    fmt::format("{} {}", hash(text), name_of_file(path)),
                                    fmt::format("{} {}", hash(scene.text), name_of_file(scene.path))};
  for (const std::string& table : tables) lines.push_back(fmt::format("{} {}", file_hash(table), name_of_file(table)));
  return lines;
}

Family load_family(const std::string& path) {
  const std::string text = read_yaml_text(path, "family");
  try {
    return read_family(path, text);
  } catch (const YAML::Exception& error) {
    throw SceneError(fmt::format("{}: {}", quote_path(path), quote(error.what(), kMaxMessage)));
  }
}

void require_drive(const Scene& scene) {
  if (!std::holds_alternative<std::monostate>(scene.drive)) return;
  throw SceneError(fmt::format("{}: drive is left out; a run needs one", quote_path(scene.files.front())));
}

}  // namespace youbot_base_sim
