// SPDX-License-Identifier: Apache-2.0
#include "convert/input/checkpoint.h"

#include "format/numbers/count_text.h"
#include "convert/input/checkpoint_cameras.h"
#include "convert/input/checkpoint_files.h"
#include "convert/input/checkpoint_model.h"
#include "convert/input/input_file.h"
#include <gsc/error.h>

#include <utility>

namespace gsc {

namespace {

constexpr uint64_t kMaxConfig = 1u << 20, kMaxMetre = 1u << 12;

// Reads the trainer's settings. config.yaml exists in Octree-AnyGS models only and is preferred there, because their
// cfg_args lacks the optimisation parameters.
ConfigFile readConfig(const CheckpointFiles& files, bool any_gs, Checkpoint& checkpoint)
{
    ConfigFile config;
    const std::string yaml = any_gs ? files.findBeside("config.yaml") : std::string();
    config.path = yaml.empty() ? files.findBeside("cfg_args") : yaml;
    if (!config.found()) {
        if (!any_gs)
            checkpoint.warnings.push_back("cfg_args: not found beside the model; pass the folder that holds it with "
                                          "--scene-dir");
        return config;
    }
    checkpoint.cfg_args = readTextFile(config.path, kMaxConfig, "the trainer's settings");
    if (yaml.empty()) {
        config.values = parsePythonNamespace(checkpoint.cfg_args, config.path);
        return config;
    }
    const ConfigValue tree = parseYaml(checkpoint.cfg_args, config.path);
    const ConfigValue* const model = tree.find("model_params");
    if (!model || model->keys.empty())
        throw Error(ErrorCode::InvalidFile, config.path, "holds no settings of a model",
                    "them below 'model_params' as Octree-AnyGS writes them", "restore the file, or remove it");
    config.values = *model;
    if (const ConfigValue* optim = tree.find("optim_params"))
        config.optim = *optim;
    if (const ConfigValue* pipeline = tree.find("pipeline_params"))
        config.pipeline = *pipeline;
    return config;
}

} // namespace

std::string ConfigFile::modelKey(const char* key) const
{
    const std::string nested = std::string("model_config.kwargs.") + key;
    return values.find(nested) ? nested : key;
}

ModelFamily detectFamily(const PlyHeader& header, const std::string& path)
{
    if (header.find("f_dc_0"))
        throw Error(ErrorCode::Unsupported, path,
                    header.find("f_offset_0")
                        ? "is an Octree-AnyGS model of explicit 3DGS or 2DGS Gaussians (columns f_dc_<n>)"
                        : "is a plain 3D Gaussian PLY (columns f_dc_<n>), not a structured model",
                    "anchors with networks", "open it in a viewer of 3DGS, or train with Scaffold-GS or Octree-GS");
    if (header.find("filter_3D"))
        throw Error(ErrorCode::Unsupported, path,
                    "has a column filter_3D, by which its trainer widens every Gaussian as Mip-Splatting does",
                    "Scaffold-GS or Octree-GS without it", "train with one of these");
    if (header.find("f_mask_0"))
        throw Error(ErrorCode::Unsupported, path,
                    "has columns f_mask_<n>, so this is a HAC model, whose features must first be quantised by its "
                    "context model",
                    "Scaffold-GS or Octree-GS", "train with one of these");
    if (header.find("info"))
        return ModelFamily::OctreeGs;
    return header.find("nx") && !header.find("level") ? ModelFamily::ScaffoldGs : ModelFamily::OctreeAnyGs;
}

Checkpoint readCheckpoint(const std::string& path, const CheckpointOptions& options)
{
    const CheckpointFiles files = findCheckpointFiles(path, options);
    Checkpoint checkpoint;
    checkpoint.model_path = path;
    checkpoint.ply_path = files.ply;
    checkpoint.iteration = files.iteration;
    checkpoint.warnings = files.warnings;

    const PlyFile ply(files.ply);
    checkpoint.family = detectFamily(ply.header(), files.ply);
    const AnchorColumns columns = findAnchorColumns(ply.header(), files.ply);
    if (ply.header().row_count == 0)
        throw Error(ErrorCode::InvalidFile, files.ply, "has no vertices", "at least one anchor", "train longer");
    if (columns.feature.size() > 1024 || columns.offset.size() > 3 * 256)
        throw Error(ErrorCode::Unsupported, files.ply,
                    formatString("has %s and %s per anchor",
                                 formatCount(columns.feature.size(), "feature value").c_str(),
                                 formatCount(columns.offset.size() / 3, "offset").c_str()),
                    "at most 1024 and 256", "train with fewer");
    checkpoint.anchor_count = ply.header().row_count;
    checkpoint.feat_dim = uint32_t(columns.feature.size());
    checkpoint.n_offsets = uint32_t(columns.offset.size() / 3);

    readWeights(files, checkpoint);
    if (checkpoint.family == ModelFamily::ScaffoldGs && checkpoint.container == "v1")
        checkpoint.family = ModelFamily::ScaffoldGsV1;
    const bool any_gs = checkpoint.family == ModelFamily::OctreeAnyGs;
    checkpoint.raster_rules = any_gs ? RasterRules::Gsplat : RasterRules::DiffGaussian;

    const ConfigFile config = readConfig(files, any_gs, checkpoint);
    if (any_gs && !config.found())
        checkpoint.warnings.push_back(files.ply +
                                      ": taken for an Octree-AnyGS model because it has neither normals nor "
                                      "'info'; no config.yaml confirms it");
    refuseOtherPictures(checkpoint, config, !columns.level.empty());
    if (config.values.getBool("white_background", false, config.path))
        checkpoint.flags |= kModelWhiteBackground;
    const uint32_t embedding_rows = checkpoint.embeddingRows();
    assignInputs(checkpoint, config, options);
    readLevels(checkpoint, ply, columns, config, options);
    checkpoint.cameras =
        readCameras(files, config.found() ? &config.values : nullptr, config.path, embedding_rows, checkpoint.warnings);
    if (const std::string metre = files.findBeside(kMetreFile); !metre.empty())
        checkpoint.metre = parseMetreFile(readTextFile(metre, kMaxMetre, "the length of a metre"), metre);
    return checkpoint;
}

} // namespace gsc
