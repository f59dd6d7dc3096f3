#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <set>
#include <sstream>

#include "lib/scene/animation.h"
#include "lib/scene/free_form_recipe.h"
#include "lib/scene/instanced_medium.h"
#include "lib/scene/key_depth.h"
#include "lib/scene/keyframes.h"
#include "lib/scene/param_reader.h"
#include "lib/scene/scene.h"

namespace pileus {

void RenderSettings::describe(ParamTable& params) {
  params.plugin<Integrator>("integrator", integrator, "march", "what happens along a ray");
  params.size("size", size, "pixels", "width and height of the picture").at_least(1).at_most(65536);
  params
      .number("tolerance", tolerance, "1", "accepted absolute error per channel of linear radiance; 0: exact")
      .at_least(0);
  params.integer("pixel_samples", pixel_samples, "n: a regular grid of n x n rays per pixel")
      .at_least(1)
      .at_most(64);
  params.integer("max_bounces", max_bounces, "how often a ray is followed on by mirrors and glass")
      .at_least(0)
      .at_most(64);
  params.integer("seed", seed, "seed of random numbers, recorded in the picture").at_least(0);
  params.text(
      "aovs", aovs,
      "planes to write: beauty, transmittance, Z, samples, error_estimate, error_bound (comma-separated)");
}

namespace {

constexpr int kSceneVersion = 1;
constexpr uintmax_t kMaxSceneBytes = 64u << 20;

/// FNV-1a: short, stable over platforms and versions, and no secret depends on it.
uint64_t hash_text(std::string_view text) {
  uint64_t hash = 14695981039346656037ull;
  for (const char c : text) hash = (hash ^ uint64_t(uint8_t(c))) * 1099511628211ull;
  return hash;
}

toml::table parse_toml(std::string_view text, const std::string& name) {
  check_key_depth(text, name);
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    const auto& begin = error.source().begin;
    throw Error(ErrorKind::scene, SourceLoc{name, int(begin.line), int(begin.column)},
                std::string(error.description()));
  }
}

/// A table whose `value` is what the text means on a command line: TOML where it parses, a string otherwise
/// (so strings need no quotes). `name` becomes the source of the value, for messages.
toml::table parse_override_value(const std::string& text, const std::string& name) {
  try {
    toml::table parsed = toml::parse("value = " + text, name);
    if (parsed.size() == 1) return parsed;
  } catch (const toml::parse_error&) {
    try {
      std::ostringstream quoted;
      quoted << toml::value<std::string>(text);
      return toml::parse("value = " + quoted.str(), name);
    } catch (const toml::parse_error& error) {
      throw Error(ErrorKind::usage, name, std::string(error.description()));
    }
  }
  throw Error(ErrorKind::usage, name, "expected a single value");
}

/// Applies `path.to.key=value`, making the tables on the way.
void apply_override(toml::table& root, const std::string& assignment) {
  const std::string name = "--set " + assignment;
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw Error(ErrorKind::usage, name, "expected path.to.key=value");
  }
  const auto trimmed = [](const std::string& text) {
    const size_t first = text.find_first_not_of(' '), last = text.find_last_not_of(' ');
    return first == std::string::npos ? std::string() : text.substr(first, last - first + 1);
  };
  std::istringstream path(assignment.substr(0, equals));
  std::vector<std::string> keys;
  for (std::string key; std::getline(path, key, '.');) keys.push_back(trimmed(key));
  const bool has_gap = assignment[equals - 1] == '.' || std::count(keys.begin(), keys.end(), "") > 0;
  if (has_gap || keys.size() > kMaxKeyParts) {
    throw Error(ErrorKind::usage, name, "expected path.to.key=value");
  }
  const toml::source_region source{{1, 1}, {1, 1}, std::make_shared<const std::string>(name)};

  toml::table* table = &root;
  for (size_t i = 0; i + 1 < keys.size(); ++i) {
    toml::node& child = table->insert(toml::key(keys[i], source), toml::table{}).first->second;
    if (!child.is_table()) {
      throw Error(ErrorKind::usage, name,
                  fmt::format("\"{}\" is {}, not a table", keys[i], describe_node(child)));
    }
    table = child.as_table();
  }
  toml::table value = parse_override_value(assignment.substr(equals + 1), name);
  table->insert_or_assign(toml::key(keys.back(), source), std::move(*value.get("value")));
}

/// Reads the sections of one scene, in the order of the file format.
class SceneReader {
 public:
  SceneReader(const toml::table& root, const std::string& name, const std::filesystem::path& folder)
      : m_root(root), m_reader(name, folder) {}

  Scene read() {
    check_version();
    check_section_names();
    read_settings("render", [&](ParamTable& params) { m_scene.render.describe(params); });
    read_display();
    read_textures();
    m_scene.camera = read_plugin<Camera>("camera", "");
    m_scene.background = read_plugin<Background>("background", "constant");
    m_scene.lights = read_named<Light>();
    m_scene.volumes = read_named<Medium>();
    m_scene.objects = read_named<Shape>();
    m_scene.fogs = read_named<FogModel>();
    read_freeforms();
    check_references();
    light_instances();
    make_freeforms();
    if (!m_reader.problems().empty()) throw Error(ErrorKind::scene, m_reader.sorted_problems());
    m_scene.files = m_reader.files();
    return std::move(m_scene);
  }

 private:
  void check_version() {
    const toml::node* version = m_root.get("pileus");
    const auto* number = version ? version->as_integer() : nullptr;
    if (number && number->get() == kSceneVersion) return;
    m_reader.problem(version ? m_reader.loc(*version) : m_reader.loc(m_root),
                     version ? fmt::format("pileus = {}; this program reads version {}",
                                           describe_node(*version), kSceneVersion)
                             : fmt::format("no version; a scene starts with `pileus = {}`", kSceneVersion));
  }

  void check_section_names() {
    const std::vector<std::string> known{"pileus",        "render",       "display",       "camera",
                                         "background",    Light::kKind,   Medium::kKind,   Shape::kKind,
                                         FogModel::kKind, Texture::kKind, kFreeFormSection};
    for (const auto& [key, node] : m_root) {
      const std::string name(key.str());
      if (std::find(known.begin(), known.end(), name) != known.end()) continue;
      const std::string nearest = nearest_name(name, known);
      m_reader.problem(m_reader.loc(key.source()),
                       fmt::format("unknown section \"{}\"; expected {}{}", name, join_or(known),
                                   nearest.empty() ? "" : "; nearest: " + nearest));
    }
  }

  /// The table of a section; an empty one where the file has none, null after a problem.
  const toml::table* section(std::string_view name) {
    static const toml::table empty;
    const toml::node* node = m_root.get(name);
    if (!node) return &empty;
    if (!node->is_table()) {
      m_reader.problem(m_reader.loc(*node),
                       fmt::format("{} is {}; expected a section [{}]", name, describe_node(*node), name));
    }
    return node->as_table();
  }

  template <class Describe>
  void read_settings(std::string_view name, Describe&& describe) {
    const toml::table* table = section(name);
    if (!table) return;
    ParamTable params;
    describe(params);
    m_reader.read(*table, params, std::string(name));
  }

  void read_display() {
    std::string curve = "srgb";
    DisplayTransform& display = m_scene.display;
    read_settings("display", [&](ParamTable& params) {
      params.number("exposure", display.exposure_stops, "stops", "radiance is multiplied by 2^exposure")
          .at_least(-kMaxExposureStops)
          .at_most(kMaxExposureStops);
      params.text("curve", curve, "how linear values become display values").one_of({"srgb", "gamma"});
      params.number("gamma", display.gamma, "1", "exponent of the gamma curve").above(0);
    });
    display.curve = curve == "gamma" ? DisplayCurve::gamma : DisplayCurve::srgb;
  }

  /// A section that is one plugin: [camera], [background]. Without a default its absence is a problem.
  template <class Kind>
  std::shared_ptr<const Kind> read_plugin(const std::string& name, const std::string& default_name) {
    std::shared_ptr<Plugin> plugin;
    if (const toml::node* node = m_root.get(name)) {
      plugin = m_reader.make_plugin(Kind::kKind, *node, name);
    } else if (!default_name.empty()) {
      plugin = m_reader.make_default_plugin(Kind::kKind, default_name);
    } else {
      m_reader.problem(m_reader.loc(m_root),
                       fmt::format("the scene has no [{}]; expected one with type = {}", name,
                                   join_or(plugin_registry().names(Kind::kKind))));
    }
    return std::dynamic_pointer_cast<const Kind>(plugin);
  }

  /// The named plugins of a kind: [light.sun], [light.fill], in the order of their names.
  template <class Kind>
  std::vector<Named<Kind>> read_named() {
    std::vector<Named<Kind>> objects;
    const toml::table* table = section(Kind::kKind);
    if (!table) return objects;
    for (const auto& [key, node] : *table) {
      const std::string name(key.str());
      const auto plugin =
          m_reader.make_plugin(Kind::kKind, node, fmt::format("{} \"{}\"", Kind::kKind, name));
      objects.push_back({name, std::dynamic_pointer_cast<const Kind>(plugin)});
    }
    return objects;
  }

  /// Before the objects that name them.
  void read_textures() {
    m_scene.textures = read_named<Texture>();
    for (const Named<Texture>& texture : m_scene.textures) {
      m_reader.add_object(Texture::kKind, texture.name, texture.object);
    }
  }

  void read_freeforms() {
    const toml::table* table = section(kFreeFormSection);
    if (!table) return;
    for (const auto& [key, node] : *table) {
      const std::string name(key.str()), owner = fmt::format("{} \"{}\"", kFreeFormSection, name);
      if (!node.is_table()) {
        m_reader.problem(m_reader.loc(node),
                         fmt::format("{} is {}; expected a table", owner, describe_node(node)));
        continue;
      }
      FreeFormRecipe& recipe = m_freeforms[name];
      ParamTable params;
      recipe.describe(params);
      const size_t problems_before = m_reader.problems().size();
      m_reader.read(*node.as_table(), params, owner);
      if (m_reader.problems().size() != problems_before) continue;
      std::vector<std::string> complaints;
      recipe.check(complaints);
      for (const std::string& complaint : complaints) {
        m_reader.problem(m_reader.loc(node), fmt::format("{}: {}", owner, complaint));
      }
    }
  }

  /// Where a free form names another.
  SourceLoc place_of_operand(const std::string& name, const std::string& operand) const {
    const std::string owner = fmt::format("{} \"{}\"", kFreeFormSection, name);
    for (const PendingReference& reference : m_reader.references()) {
      if (reference.owner.find(owner) == 0 && reference.name == operand) return reference.loc;
    }
    return {};
  }

  /// Makes the free forms where nothing is wrong with them.
  void make_freeforms() {
    if (const auto cycle = find_cycle(m_freeforms)) {
      m_reader.problem(
          place_of_operand(cycle->name, cycle->operand),
          fmt::format("{} \"{}\" is made of itself: {}; expected free forms that do not lead back",
                      kFreeFormSection, cycle->name, cycle->path));
    }
    if (!m_reader.problems().empty()) return;
    std::vector<std::string> too_large;
    m_scene.freeforms = make_free_forms(m_freeforms, too_large);
    const toml::table* table = section(kFreeFormSection);
    for (const std::string& name : too_large) {
      m_reader.problem(m_reader.loc(*table->get(name)),
                       fmt::format("{} \"{}\" is made of more than 20000 functions; expected fewer",
                                   kFreeFormSection, name));
    }
  }

  void check_references() {
    for (const PendingReference& reference : m_reader.references()) {
      const toml::table* table = section(reference.section);
      if (table && table->contains(reference.name)) continue;
      std::vector<std::string> names;
      if (table) {
        for (const auto& [key, node] : *table) names.emplace_back(key.str());
      }
      const std::string nearest = nearest_name(reference.name, names);
      m_reader.problem(reference.loc,
                       fmt::format("{}: there is no {} \"{}\"; the scene has {}{}", reference.owner,
                                   reference.section, reference.name, names.empty() ? "none" : join_or(names),
                                   nearest.empty() ? "" : "; nearest: " + nearest));
    }
  }

  /// Instances of volumes get the light of these; those of instances, too.
  void light_instances() {
    if (!m_reader.problems().empty()) return;
    constexpr size_t kDeepest = 32;
    const toml::table* table = section(Medium::kKind);
    const auto volume = [&](const std::string& name) {
      return std::find_if(m_scene.volumes.begin(), m_scene.volumes.end(),
                          [&](const Named<Medium>& named) { return named.name == name; });
    };
    for (Named<Medium>& named : m_scene.volumes) {
      const auto* instance = dynamic_cast<const InstancedMedium*>(named.object.get());
      if (!instance) continue;
      std::string path = named.name;
      std::shared_ptr<const Medium> original;
      for (size_t depth = 0; instance && depth <= kDeepest; ++depth) {
        path += " -> " + instance->original();
        original = volume(instance->original())->object;
        instance = dynamic_cast<const InstancedMedium*>(original.get());
      }
      if (instance) {
        m_reader.problem(
            m_reader.loc(*table->get(named.name)),
            fmt::format("volume \"{}\" is made of itself, or of instances of instances more than {} "
                        "times: {}; expected volumes that do not lead back",
                        named.name, kDeepest, path.substr(0, 120)));
      } else {
        // Nobody else has seen it yet.
        static_cast<MediumLight&>(*std::const_pointer_cast<Medium>(named.object)) = *original;
      }
    }
  }

  static constexpr const char* kFreeFormSection = FreeFormRecipe::kSection;

  const toml::table& m_root;
  ParamReader m_reader;
  FreeFormRecipes m_freeforms;
  Scene m_scene;
};

std::string read_text(const std::filesystem::path& file) {
  std::error_code failure;
  const uintmax_t bytes = std::filesystem::file_size(file, failure);
  if (failure) throw Error(ErrorKind::file, file.string(), "cannot be read: " + failure.message());
  if (bytes > kMaxSceneBytes) {
    throw Error(ErrorKind::file, file.string(), fmt::format("has {} bytes: too large for a scene", bytes));
  }
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    throw Error(ErrorKind::file, file.string(), fmt::format("cannot be opened: {}", std::strerror(errno)));
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// Adds the free forms that a part of a scene names, and those that these name in turn.
void add_forms_named_in(const toml::node& part, const toml::table& root, std::set<std::string>& forms) {
  if (const toml::table* table = part.as_table()) {
    for (const auto& [key, child] : *table) add_forms_named_in(child, root, forms);
  } else if (const toml::array* array = part.as_array()) {
    for (const toml::node& child : *array) add_forms_named_in(child, root, forms);
  } else if (const auto* name = part.as_string()) {
    const toml::node* form = root[FreeFormRecipe::kSection][name->get()].node();
    if (form && forms.insert(name->get()).second) add_forms_named_in(*form, root, forms);
  }
}

std::set<std::string> forms_named_in(const toml::node& part, const toml::table& root) {
  std::set<std::string> forms;
  add_forms_named_in(part, root, forms);
  return forms;
}

/// A volume, the one that it is an instance of, and so on.
std::vector<std::reference_wrapper<const toml::node>> with_originals(const toml::node& volume,
                                                                     const toml::table& volumes) {
  std::vector<std::reference_wrapper<const toml::node>> nodes{volume};
  while (nodes.size() <= volumes.size()) {
    const toml::table* table = nodes.back().get().as_table();
    const auto* of = table ? table->get_as<std::string>("of") : nullptr;
    const toml::node* original = of ? volumes.get(of->get()) : nullptr;
    if (!original) break;
    nodes.emplace_back(*original);
  }
  return nodes;
}

/// The text as a tree, with overrides, at a frame.
toml::table read_root(std::string_view text, const std::string& name,
                      const std::vector<std::string>& overrides, double frame) {
  toml::table root = parse_toml(text, name);
  for (const std::string& assignment : overrides) apply_override(root, assignment);
  std::vector<Diagnostic> problems = resolve_keyframes(root, frame, name);
  if (!problems.empty()) throw Error(ErrorKind::scene, std::move(problems));
  return root;
}

}  // namespace

Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& folder,
                  const std::vector<std::string>& overrides, double frame) {
  const toml::table root = read_root(text, name, overrides, frame);
  Scene scene = SceneReader(root, name, folder).read();
  scene.file = name;
  bool changes_over_time = false;
  for (auto& [form_name, form] : scene.freeforms) {
    if (!form.changes_over_time()) continue;
    form = form.at(frame);
    changes_over_time = true;
  }
  std::ostringstream canonical;
  canonical << root;
  if (changes_over_time) canonical << "\nframe " << fmt::format("{}", frame);
  scene.hash = hash_text(canonical.str());
  return scene;
}

Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& folder,
                  const std::vector<std::string>& overrides) {
  return parse_scene(text, name, folder, overrides, 0.0);
}

Scene load_scene(const std::filesystem::path& file, const std::vector<std::string>& overrides) {
  return load_scene(file, overrides, 0.0);
}

Scene load_scene(const std::filesystem::path& file, const std::vector<std::string>& overrides, double frame) {
  return parse_scene(read_text(file), file.string(), file.parent_path(), overrides, frame);
}

std::map<std::string, uint64_t> volume_keys(const std::filesystem::path& file,
                                            const std::vector<std::string>& overrides, double frame) {
  const toml::table root = read_root(read_text(file), file.string(), overrides, frame);
  std::map<std::string, uint64_t> keys;
  const toml::table* volumes = root[Medium::kKind].as_table();
  if (!volumes) return keys;
  for (const auto& [name, node] : *volumes) {
    std::ostringstream text;
    for (const toml::node& volume : with_originals(node, *volumes)) {
      text << toml::node_view(volume);
      for (const std::string& form : forms_named_in(volume, root))
        text << form << root[FreeFormRecipe::kSection][form];
      const auto texture = toml::node_view(volume)["density_texture"].value<std::string>();
      if (texture) text << root[Texture::kKind][*texture];
    }
    if (text.str().find("beta_over_time") != std::string::npos) text << fmt::format("frame {}", frame);
    keys[std::string(name.str())] = hash_text(text.str());
  }
  return keys;
}

}  // namespace pileus
