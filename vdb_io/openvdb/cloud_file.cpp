#include <fmt/format.h>

#include "lib/core/atomic_file.h"
#include "lib/core/named_errors.h"
#include "lib/core/version.h"
#include "vdb_io/openvdb/build_cloud.h"
#include "vdb_io/openvdb/cloud_grids.h"
#include "vdb_io/openvdb/vdb_writer.h"

namespace pileus {
namespace {

using Grids = std::vector<openvdb::GridBase::Ptr>;

void check_not_cancelled(CloudFileWatch& watch) {
  if (!watch.go_on(1.0)) throw Error(ErrorKind::cancelled, SourceLoc{}, "building the cloud was cancelled");
}

Grids build_grids(const NamedCloud& named, const std::vector<std::string>& names, CloudFileWatch& watch) {
  CloudGridOptions options = named.options;
  options.progress = [&](double share) { return watch.go_on(share); };
  CloudBuildCounters counters;
  watch.begin(named);
  const openvdb::FloatGrid::Ptr density = build_cloud(named.cloud, options, &counters);
  watch.end(named, counters);

  const CloudFields fields(named.fields, named.cloud);
  Grids grids;
  for (const std::string& name : names) {
    grids.push_back(name == "density" ? density : build_cloud_field(name, fields, *density));
    check_not_cancelled(watch);
  }
  return grids;
}

}  // namespace

std::vector<WrittenGrid> write_cloud_file(const CloudFile& file, CloudFileWatch& watch) {
  const AtomicFile probe(file.path);  // refuse now what could not be written after a long build
  std::vector<openvdb::GridBase::ConstPtr> grids;
  for (const NamedCloud& cloud : file.clouds) {
    const Grids built =
        named_errors("volume", cloud.name, [&] { return build_grids(cloud, file.grids, watch); });
    for (const openvdb::GridBase::Ptr& grid : built) {
      if (file.clouds.size() > 1)
        grid->setName(file.grids.size() == 1 ? cloud.name : cloud.name + "_" + grid->getName());
      grids.push_back(grid);
    }
  }
  openvdb::MetaMap metadata;
  metadata.insertMeta("creator", openvdb::StringMetadata(fmt::format("pileus {}", kVersion)));
  write_vdb_grids(file.path, grids, metadata, file.write);

  std::vector<WrittenGrid> written;
  for (const auto& grid : grids) written.push_back(written_grid(*grid));
  return written;
}

}  // namespace pileus
