// SPDX-License-Identifier: Apache-2.0
// Settings and weights of whole models as people's machines leave them.
#include "convert/input/checkpoint.h"
#include "convert/input/torch/torch_archive.h"
#include "tests/input/model_fixture.h"
#include "tests/input/torch_files.h"

#include <doctest/doctest.h>

#include <algorithm>

using namespace gsc;
using namespace gsc::test;

namespace fs = std::filesystem;

namespace {

Outcome readingOf(const fs::path& path)
{
    return outcomeOf([&] { (void)readCheckpoint(path.string(), {}); });
}

std::string utf16(const std::string& ascii, bool big_endian)
{
    std::string bytes = big_endian ? "\xfe\xff" : "\xff\xfe";
    for (const char c : ascii) {
        bytes += big_endian ? '\0' : c;
        bytes += big_endian ? c : '\0';
    }
    return bytes;
}

// The tensors of an MLP as a state dictionary has them, every name behind `prefix`.
std::vector<NamedTensor> stateOf(const Mlp& mlp, const std::string& prefix)
{
    std::vector<NamedTensor> tensors;
    for (size_t i = 0; i < 2; ++i) {
        const LinearLayer& layer = mlp.layers[i];
        const std::string name = prefix + (i == 0 ? "0." : "2.");
        tensors.push_back({name + "weight", {layer.out, layer.in}, layer.weight});
        tensors.push_back({name + "bias", {layer.out}, layer.bias});
    }
    return tensors;
}

constexpr const char* kNames[] = {"opacity_mlp", "cov_mlp", "color_mlp"};

void checkSame(const Checkpoint& read, const WeightSet& weights)
{
    REQUIRE(read.mlps.size() == weights.mlps.size());
    for (size_t i = 0; i < read.mlps.size(); ++i)
        for (size_t layer = 0; layer < 2; ++layer) {
            CHECK(read.mlps[i].layers[layer].weight == weights.mlps[i].layers[layer].weight);
            CHECK(read.mlps[i].layers[layer].bias == weights.mlps[i].layers[layer].bias);
        }
    CHECK(read.embedding == weights.embedding);
}

} // namespace

TEST_CASE("as left: settings with byte order marks, in UTF-16, with line ends of Windows")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    writeModel(folder.path() / "a", spec);
    const std::string text = "Namespace(voxel_size=0.5, white_background=True)";
    for (const std::string& bytes : {text, "\xef\xbb\xbf" + text, text + "\r\n", "\xef\xbb\xbf" + text + "\r\n",
                                     utf16(text, false), utf16(text, true), utf16(text + "\r\n", false)}) {
        writeFile(folder.path() / "a/cfg_args", bytes);
        const Checkpoint read = readCheckpoint((folder.path() / "a").string(), {});
        CHECK(read.voxel_size == 0.5f);
        CHECK(read.flags == kModelWhiteBackground);
    }
    spec.columns = Columns::AnyBase;
    spec.cfg_args = "";
    writeModel(folder.path() / "b", spec);
    const std::string yaml =
        "model_params:\r\n  white_background: True\r\n  model_config: {kwargs: {voxel_size: 0.5}}\r\n";
    for (const std::string& bytes : {yaml, "\xef\xbb\xbf" + yaml, utf16(yaml, false), utf16(yaml, true)}) {
        writeFile(folder.path() / "b/config.yaml", bytes);
        const Checkpoint read = readCheckpoint((folder.path() / "b").string(), {});
        CHECK(read.voxel_size == 0.5f);
        CHECK(read.flags == kModelWhiteBackground);
    }
    const std::string cameras = "[{\"id\":0,\"img_name\":\"a\",\"width\":8,\"height\":8,\"position\":[0,0,0],"
                                "\"rotation\":[[1,0,0],[0,1,0],[0,0,1]],\"fx\":9,\"fy\":9}]";
    for (const std::string& bytes : {cameras, "\xef\xbb\xbf" + cameras, utf16(cameras, false), utf16(cameras, true)}) {
        writeFile(folder.path() / "a/cameras.json", bytes);
        CHECK(readCheckpoint((folder.path() / "a").string(), {}).cameras.size() == 1);
    }
}

TEST_CASE("as left: weights of wrapped networks, in every container")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.widths.appearance_rows = 3;
    spec.widths.appearance_columns = 2;
    const WeightSet weights = makeWeights(spec.n_offsets, spec.feat_dim, spec.widths);
    const NamedTensor embedding{"embedding.weight", {weights.rows, weights.columns}, weights.embedding};
    for (const std::string prefix : {"", "module.", "_orig_mod.", "module._orig_mod.", "_orig_mod.module."}) {
        CAPTURE(prefix);
        const fs::path model = folder.path() / ("m" + prefix), iteration = writeModel(model, spec);
        writeSplit(iteration, weights);
        for (size_t i = 0; i < 3; ++i)
            writeFile(iteration / (std::string(kNames[i]) + ".pt"),
                      writeTensorArchive(stateOf(weights.mlps[i], prefix)));
        NamedTensor wrapped = embedding;
        wrapped.name = prefix + embedding.name;
        writeFile(iteration / "embedding_appearance.pt", writeTensorArchive(std::span(&wrapped, 1)));
        checkSame(readCheckpoint(model.string(), {}), weights);

        // the prefix of one network, or of a module that holds them all
        for (const auto& [before, behind] : {std::pair{prefix, std::string()}, {std::string(), prefix}}) {
            std::vector<NamedTensor> all;
            for (size_t i = 0; i < 3; ++i)
                for (NamedTensor& tensor : stateOf(weights.mlps[i], before + kNames[i] + "." + behind))
                    all.push_back(std::move(tensor));
            all.push_back(embedding);
            all.back().name = before + "appearance." + behind + embedding.name;
            for (const auto& entry : fs::directory_iterator(iteration))
                if (entry.path().extension() != ".ply")
                    fs::remove(entry.path());
            for (const char* file : {"checkpoints.pth", "checkpoint.pth"}) {
                writeFile(iteration / file, writeTensorArchive(all));
                checkSame(readCheckpoint(model.string(), {}), weights);
                fs::remove(iteration / file);
            }
        }
    }
}

TEST_CASE("as left: weights of other networks end as unsupported, with the names that were found")
{
    const TemporaryFolder folder;
    const ModelSpec spec;
    const fs::path iteration = writeModel(folder.path(), spec);
    const WeightSet weights = makeWeights(spec.n_offsets, spec.feat_dim, spec.widths);
    for (const char* prefix : {"state_dict.", "model.", "net.", "module.layers.", "_module."}) {
        writeFile(iteration / "cov_mlp.pt", writeTensorArchive(stateOf(weights.mlps[1], prefix)));
        const Outcome outcome = readingOf(folder.path());
        CHECK(outcome.code == ErrorCode::Unsupported);
        CHECK_MESSAGE(outcome.says("found '"), outcome.message);
    }
    std::vector<NamedTensor> twice = stateOf(weights.mlps[1], "");
    for (NamedTensor& tensor : stateOf(weights.mlps[1], "module."))
        twice.push_back(std::move(tensor));
    writeFile(iteration / "cov_mlp.pt", writeTensorArchive(twice));
    CHECK(readingOf(folder.path()).code == ErrorCode::Unsupported);
    CHECK(readingOf(folder.path()).says("both '0.weight' and 'module.0.weight'"));
    writeFile(iteration / "cov_mlp.pt", writeTensorArchive({}));
    CHECK(readingOf(folder.path()).says("found none"));
}

TEST_CASE("as left: a Git LFS pointer instead of each file of a model")
{
    const std::string pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:aa\nsize 12\n";
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.columns = Columns::AnyLod;
    spec.widths.bank = 0;
    spec.widths.appearance_rows = 3;
    spec.widths.appearance_columns = 2;
    spec.cfg_args = "";
    const std::string yaml = "model_params: {model_config: {kwargs: {fork: 2, dist2level: 'round'}}}\n";
    for (const char* file : {"point_cloud.ply", "opacity_mlp.pt", "cov_mlp.pt", "color_mlp.pt", "feature_bank_mlp.pt",
                             "embedding_appearance.pt", "../../config.yaml", "../../cameras.json"}) {
        const fs::path model = folder.path() / fs::path(file).filename();
        const fs::path iteration = writeModel(model, spec);
        writeFile(model / "config.yaml", yaml);
        CHECK(readingOf(model).code == ErrorCode::Ok);
        writeFile(iteration / file, pointer);
        const Outcome outcome = readingOf(model);
        CHECK(outcome.code == ErrorCode::InvalidFile);
        CHECK_MESSAGE(outcome.says("is a Git LFS pointer, expected the file of 12 bytes"), outcome.message);
        CHECK(outcome.says(fs::path(file).filename().string()));
    }
    spec.columns = Columns::Scaffold;
    spec.widths = {};
    for (const char* file : {"checkpoints.pth", "checkpoint.pth"}) {
        const fs::path model = folder.path() / file, iteration = writeModel(model, spec);
        for (const char* name : kNames)
            fs::remove(iteration / (std::string(name) + ".pt"));
        writeFile(iteration / file, pointer);
        CHECK(readingOf(model).says("is a Git LFS pointer"));
    }
    // cameras that cannot be used cost nothing else
    const fs::path model = folder.path() / "transforms";
    writeModel(model, spec);
    writeFile(model / "transforms.json", pointer);
    const Checkpoint read = readCheckpoint(model.string(), {});
    CHECK(std::ranges::any_of(read.warnings, [](const std::string& warning) {
        return warning.find("transforms.json: is a Git LFS pointer") != std::string::npos;
    }));
}

TEST_CASE("as left: settings with which the trainer draws another picture are refused, by key and value")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    writeModel(folder.path() / "a", spec);
    const auto scaffold = [&](const std::string& settings) {
        writeFile(folder.path() / "a/cfg_args", "Namespace(voxel_size=0.5, " + settings + ")");
        return readingOf(folder.path() / "a");
    };
    for (const auto& [setting, said] : {std::pair{"random_background=True", "random_background is True"},
                                        {"random_background=1", "is 1"},
                                        {"antialiasing=True", "antialiasing is True"},
                                        {"kernel_size=0.1", "kernel_size is 0.1, so the trainer widens"},
                                        {"eps2d=0.0", "eps2d is 0"},
                                        {"rasterize_mode='antialiased'", "rasterize_mode is 'antialiased'"},
                                        {"camera_model='ortho'", "camera_model is 'ortho'"},
                                        {"render_mode='ED'", "render_mode is 'ED'"},
                                        {"gs_attr='2D'", "gs_attr is '2D'"},
                                        {"scaling_modifier=0.5", "expected 1"},
                                        {"resolution_scales=[2.0]", "resolution_scales is [2]"},
                                        {"use_feat_bank=True", "feature bank"},
                                        {"compute_cov3D_python=True", "compute_cov3D_python is True"},
                                        {"radius_clip=3", "radius_clip is 3"},
                                        {"near_plane=0.5", "near_plane is 0.5"},
                                        {"far_plane=100.0", "far_plane is 100"}}) {
        const Outcome outcome = scaffold(setting);
        CHECK(outcome.code == ErrorCode::Unsupported);
        CHECK_MESSAGE(outcome.says(said), outcome.message);
        CHECK(outcome.says("so the trainer "));
    }
    CHECK(scaffold("random_background=False, antialiasing=False, kernel_size=0.3, eps2d=0.3, rasterize_mode='classic', "
                   "render_mode='RGB+ED', gs_attr='3D', resolution_scales=[1.0], use_feat_bank=False, "
                   "compute_cov3D_python=False, camera_model='pinhole', scaling_modifier=1.0, render_mode2=None")
              .message.empty());
    CHECK(scaffold("near_plane=0.2, far_plane=1e10").message.empty());
    // what is not evaluated is neither taken nor called damaged
    CHECK(scaffold("random_background=os.environ.get('A')").code == ErrorCode::Unsupported);
    CHECK(scaffold("render_mode=3").code == ErrorCode::Unsupported);

    spec.widths.bank = 1;
    writeModel(folder.path() / "bank", spec);
    writeFile(folder.path() / "bank/cfg_args", std::string("Namespace(use_feat_bank=False)"));
    CHECK(readingOf(folder.path() / "bank").says("use_feat_bank is False, so the trainer draws without"));
    writeFile(folder.path() / "bank/cfg_args", std::string("Namespace(use_feat_bank=True)"));
    CHECK(readingOf(folder.path() / "bank").message.empty());
}

TEST_CASE("as left: settings of Octree-AnyGS in all of its groups")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.columns = Columns::AnyLod;
    spec.cfg_args = "";
    writeModel(folder.path(), spec);
    const auto any = [&](const std::string& model, const std::string& kwargs = "", const std::string& pipeline = "") {
        writeFile(folder.path() / "config.yaml",
                  "model_params: {model_config: {name: GaussianLoDModel, kwargs: {fork: 2, dist2level: round, " +
                      kwargs + "}}, " + model + "}\npipeline_params: {" + pipeline + "}\n");
        return readingOf(folder.path());
    };
    CHECK(any("base_model: scaffoldgs, render_mode: RGB, random_background: False", "view_dim: 3",
              "compute_cov3D_python: True, debug: False")
              .message.empty());
    for (const auto& [model, kwargs, pipeline, said] :
         {std::tuple{"base_model: 2dgs", "", "", "base_model is '2dgs'"},
          {"render_mode: D", "", "", "render_mode is 'D'"},
          {"random_background: yes", "", "", "random_background is True"},
          {"", "view_dim: 4", "", "view_dim is 4"},
          {"", "", "antialiased: true", "antialiased is True"},
          {"", "use_feat_bank: True", "", "use_feat_bank is True"},
          {"resolution_scales: [0.5]", "", "", "resolution_scales is [0.5]"}}) {
        const Outcome outcome = any(model, kwargs, pipeline);
        CHECK(outcome.code == ErrorCode::Unsupported);
        CHECK_MESSAGE(outcome.says(said), outcome.message);
    }
    writeFile(
        folder.path() / "config.yaml",
        std::string("model_params: {model_config: {name: GaussianModel, kwargs: {fork: 2, dist2level: round}}}\n"));
    CHECK(readingOf(folder.path()).says("model_config.name is 'GaussianModel'"));
    writeFile(
        folder.path() / "config.yaml",
        std::string("model_params: {model_config: {kwargs: {fork: 2, dist2level: round}}, resolution_scales: [1.0, "
                    "2.0]}\n"));
    const Checkpoint read = readCheckpoint(folder.path().string(), {});
    CHECK(std::ranges::any_of(read.warnings, [](const std::string& warning) {
        return warning.find("resolution_scales lists 2 too") != std::string::npos;
    }));
}

TEST_CASE("as left: a column by which the trainer widens Gaussians is refused")
{
    const TemporaryFolder folder;
    const ModelSpec spec;
    const fs::path iteration = writeModel(folder.path(), spec);
    PlyText ply = makePly(spec.columns, spec.rows, spec.n_offsets, spec.feat_dim);
    ply.columns.push_back("filter_3D");
    for (std::vector<float>& row : ply.rows)
        row.push_back(0.5f);
    writeFile(iteration / "point_cloud.ply", ply.text());
    CHECK(readingOf(folder.path()).code == ErrorCode::Unsupported);
    CHECK(readingOf(folder.path()).says("filter_3D"));
}

TEST_CASE("as left: sizes that settings and model do not share are told")
{
    const TemporaryFolder folder;
    const ModelSpec spec;
    writeModel(folder.path(), spec);
    writeFile(folder.path() / "cfg_args", std::string("Namespace(feat_dim=32, n_offsets=2, appearance_dim=16)"));
    const Checkpoint read = readCheckpoint(folder.path().string(), {});
    const auto told = [&](const char* text) {
        return std::ranges::any_of(read.warnings,
                                   [&](const std::string& warning) { return warning.find(text) != std::string::npos; });
    };
    CHECK(told("feat_dim is 32, but the model has 4"));
    CHECK(told("appearance_dim is 16, but the model has 0"));
    CHECK_FALSE(told("n_offsets"));
}

TEST_CASE("files as people have them: a config.yaml that holds no settings")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.columns = Columns::AnyBase;
    spec.cfg_args = "Namespace()";
    (void)writeModel(folder.path(), spec);
    const auto said = [&](const std::string& yaml) {
        writeFile(folder.path() / "config.yaml", yaml);
        return readingOf(folder.path());
    };
    const std::string model = "{model_config: {name: GaussianModel, kwargs: {voxel_size: 0.5}}}\n";
    CHECK(said("model_params: " + model).code == ErrorCode::Ok);
    CHECK(said("{\"model_params\": " + model + "}").code == ErrorCode::Ok);
    for (const std::string& yaml :
         {std::string("404 : Not Here"), std::string("{\"answer\": \"none\"}"), std::string("hello"),
          std::string("- a\n- b\n"), std::string(), std::string("# nothing\n"), std::string("model_params:\n"),
          std::string("model_params: {}\n"), std::string("model_params: [1]\n"),
          std::string("model_params: GaussianModel\n"), "model_parameters: " + model,
          std::string("optim_params: {iterations: 1}\n"), "model:\n  model_params: " + model}) {
        CAPTURE(yaml);
        const Outcome outcome = said(yaml);
        CHECK(outcome.code == ErrorCode::InvalidFile);
        CHECK(outcome.says("config.yaml: "));
        CHECK(outcome.says("'model_params'"));
    }
    CHECK(said("404: Not Found").says("config.yaml: is an answer of a server"));
    CHECK(said("{\"message\": \"Not Found\"}").says("config.yaml: is an answer of a server"));
    CHECK(said("model_params:\n  \u00a0white_background: true\n").says("U+00A0"));
}

TEST_CASE("files as people have them: settings that are words or numbers have to be that")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    for (const char* setting : {"images='images' + '_4'", "images=4", "resolution='4'", "resolution=int(4)"}) {
        CAPTURE(setting);
        spec.cfg_args = std::string("Namespace(voxel_size=0.25, ") + setting + ")";
        (void)writeModel(folder.path(), spec);
        const Outcome outcome = readingOf(folder.path());
        CHECK(outcome.code == ErrorCode::Unsupported);
        CHECK(outcome.says(std::string(setting).substr(0, std::string(setting).find('='))));
    }
    spec.cfg_args = "Namespace(voxel_size=0.25, images=None, resolution=None)";
    (void)writeModel(folder.path(), spec);
    CHECK(readingOf(folder.path()).code == ErrorCode::Ok);
}

TEST_CASE("files as people have them: a camera file of the test pictures alone")
{
    const TemporaryFolder folder;
    (void)writeModel(folder.path(), {});
    const fs::path path = folder.path() / "transforms_test.json";
    const auto warned = [&](const std::string& text) {
        return std::ranges::any_of(readCheckpoint(folder.path().string(), {}).warnings,
                                   [&](const std::string& warning) {
                                       return warning.find("transforms_test.json: " + text) != std::string::npos;
                                   });
    };
    writeFile(path, std::string("version https://git-lfs.github.com/spec/v1\noid sha256:aa\nsize 12\n"));
    CHECK(warned("is a Git LFS pointer"));
    writeFile(path, std::string("{\"camera_angle_x\": 1, \"w\": 8, \"h\": 8, \"frames\": [{\"file_path\": \"a\", "
                                "\"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}"));
    const Checkpoint read = readCheckpoint(folder.path().string(), {});
    REQUIRE(read.cameras.size() == 1);
    CHECK(read.cameras[0].is_test);
}

TEST_CASE("files as people have them: a zip archive by the name of what is in it")
{
    const TemporaryFolder folder;
    const fs::path iteration = writeModel(folder.path(), {});
    writeFile(iteration / "point_cloud.ply", std::string("PK\x03\x04\x14") + std::string(60, '\0'));
    const Outcome outcome = readingOf(folder.path());
    CHECK(outcome.code == ErrorCode::Unsupported);
    CHECK(outcome.says("point_cloud.ply: is a zip archive"));
}
