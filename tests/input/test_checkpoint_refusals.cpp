// SPDX-License-Identifier: Apache-2.0
// Checkpoints that cannot be represented exactly are refused, with a message that names what was found and what to do.
#include "convert/input/input_file.h"
#include "convert/input/torch/torch_archive.h"
#include "convert/input/torch/zip_archive.h"
#include "convert/input/torch/zip_writer.h"
#include "tests/input/model_fixture.h"
#include "tests/input/torch_files.h"

#include <doctest/doctest.h>

#include <algorithm>

#include <sys/stat.h>

using namespace gsc;
using namespace gsc::test;

namespace fs = std::filesystem;

namespace {

void refuses(const fs::path& path, ErrorCode code, const char* found, const char* remedy)
{
    const Outcome outcome = outcomeOf([&] { (void)readCheckpoint(path.string(), {}); });
    CAPTURE(outcome.message);
    CHECK(outcome.code == code);
    CHECK(outcome.says(found));
    CHECK(outcome.says(remedy));
    CHECK(outcome.says(path.parent_path().string())); // the file or folder is named
}

// A checkpoint.pth whose opacity MLP is called `key` beside the usual three.
void writeForeign(const fs::path& folder, const ModelSpec& spec, const std::string& key)
{
    const WeightSet weights = makeWeights(spec.n_offsets, spec.feat_dim, {});
    writeFile(folder / "checkpoint.pth", writeStateDictArchive({{"opacity_mlp", &weights.mlps[0]},
                                                                {"cov_mlp", &weights.mlps[1]},
                                                                {"color_mlp", &weights.mlps[2]},
                                                                {key, &weights.mlps[0]}},
                                                               {}, 0, 0));
}

// A network as torch.save(mlp.state_dict()) leaves it.
std::vector<NamedTensor> stateDictOf(const Mlp& mlp)
{
    std::vector<NamedTensor> tensors;
    for (const size_t i : {0, 1}) {
        const LinearLayer& layer = mlp.layers[i];
        tensors.push_back({i == 0 ? "0.weight" : "2.weight", {layer.out, layer.in}, layer.weight});
        tensors.push_back({i == 0 ? "0.bias" : "2.bias", {layer.out}, layer.bias});
    }
    return tensors;
}

// Calls the weights of the first layers "params", as tiny-cuda-nn calls its one vector.
void nameAsTcnn(const fs::path& path)
{
    const std::vector<std::byte> bytes = readWholeFile(path.string(), 1u << 30, "an archive");
    const ZipArchive archive(bytes, path.string());
    const std::string first = archive.members().front();
    const size_t slash = first.find('/');
    ZipWriter writer(first.substr(0, slash));
    for (const std::string& member : archive.members()) {
        const std::vector<std::byte> content = archive.read(member);
        std::string text(reinterpret_cast<const char*>(content.data()), content.size());
        for (size_t at = 0; member.ends_with("data.pkl") && (at = text.find("0.weight", at)) != std::string::npos;)
            text.replace(at, 8, "0.params");
        writer.add(member.substr(slash + 1), text);
    }
    writeFile(path, writer.finish());
}

} // namespace

TEST_CASE("refusals, trap 33: HAC, GSDF and quantised models")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    const fs::path iteration = writeModel(folder.path(), spec);
    for (const char* name : {"opacity_mlp.pt", "cov_mlp.pt", "color_mlp.pt"})
        fs::remove(iteration / name);
    writeForeign(iteration, spec, "grid_mlp");
    refuses(folder.path(), ErrorCode::Unsupported, "HAC", "train");
    writeForeign(iteration, spec, "anchor_normals_mlp");
    nameAsTcnn(iteration / "checkpoint.pth");
    refuses(folder.path(), ErrorCode::Unsupported, "tiny-cuda-nn", "train without use_tcnn");

    PlyText hac = makePly(Columns::Scaffold, 3, spec.n_offsets, spec.feat_dim);
    hac.columns[3] = "f_mask_0";
    writeFile(iteration / "point_cloud.ply", hac.text());
    refuses(folder.path(), ErrorCode::Unsupported, "f_mask_<n>", "train with one of these");

    writeFile(iteration / "point_cloud_quantized.npz", std::string("PK"));
    refuses(folder.path(), ErrorCode::Unsupported, "point_cloud_quantized.npz", "move the npz away");
}

TEST_CASE("trap 33: GSDF with torch.nn.Linear layers is a Scaffold-GS model and an MLP that no image needs")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    const fs::path iteration = writeModel(folder.path(), spec);
    for (const char* name : {"opacity_mlp.pt", "cov_mlp.pt", "color_mlp.pt"})
        fs::remove(iteration / name);
    writeForeign(iteration, spec, "anchor_normals_mlp");
    const Checkpoint checkpoint = readCheckpoint(folder.path().string(), {});
    CHECK(checkpoint.family == ModelFamily::ScaffoldGsV1);
    REQUIRE(checkpoint.mlps.size() == 3);
    for (const Mlp& mlp : checkpoint.mlps)
        CHECK(mlp.inputs == kMlpTakesFeature); // no distance, unlike other models of this container
    CHECK(std::count_if(checkpoint.warnings.begin(), checkpoint.warnings.end(),
                        [](const std::string& warning) { return warning.find("GSDF") != std::string::npos; }) == 1);
}

TEST_CASE("refusals: layers of a state dict that are not among the two that are read")
{
    const TemporaryFolder folder;
    const ModelSpec spec;
    const fs::path iteration = writeModel(folder.path(), spec);
    const WeightSet weights = makeWeights(spec.n_offsets, spec.feat_dim, {});
    const std::vector<NamedTensor> plain = stateDictOf(weights.mlps[0]);
    const auto write = [&](const std::vector<NamedTensor>& more) {
        std::vector<NamedTensor> tensors = plain;
        tensors.insert(tensors.end(), more.begin(), more.end());
        writeFile(iteration / "opacity_mlp.pt", writeTensorArchive(tensors));
    };
    write({});
    CHECK(outcomeOf([&] { (void)readCheckpoint(folder.path().string(), {}); }).code == ErrorCode::Ok);
    const uint32_t hidden = weights.mlps[0].layers[0].out, out = weights.mlps[0].layers[1].out;
    const auto layer = [](const std::string& prefix, uint32_t rows) {
        return std::vector<NamedTensor>{
            {prefix + "weight", {rows, rows}, std::vector<float>(size_t(rows) * rows, 0.5f)},
            {prefix + "bias", {rows}, std::vector<float>(rows, 0.5f)}};
    };
    for (const char* prefix : {"3.", "4.", "5.", "norm."}) {
        write(layer(prefix, out));
        refuses(folder.path(), ErrorCode::Unsupported, ("'" + std::string(prefix) + "weight'").c_str(),
                "only the MLPs");
    }
    write({{"1.weight", {hidden}, std::vector<float>(hidden, 0.5f)},
           {"1.bias", {hidden}, std::vector<float>(hidden, 0.5f)}}); // LayerNorm
    refuses(folder.path(), ErrorCode::Unsupported, "'1.weight'", "no such layer");
    write({{"1.weight", {1}, {0.25f}}}); // PReLU
    refuses(folder.path(), ErrorCode::Unsupported, "opacity_mlp.pt: holds '1.weight'", "no such layer");
}

TEST_CASE("refusals: an embedding with layers behind it")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.widths.appearance_rows = 3;
    spec.widths.appearance_columns = 2;
    const fs::path iteration = writeModel(folder.path(), spec);
    std::vector<NamedTensor> tensors = {{"embedding.weight", {3, 2}, std::vector<float>(6, 1)}};
    writeFile(iteration / "embedding_appearance.pt", writeTensorArchive(tensors));
    CHECK(readCheckpoint(folder.path().string(), {}).mlps.size() == 3);
    tensors.push_back({"mlp.weight", {2, 2}, std::vector<float>(4, 1)});
    writeFile(iteration / "embedding_appearance.pt", writeTensorArchive(tensors));
    refuses(folder.path(), ErrorCode::Unsupported, "embedding_appearance.pt: holds 'mlp.weight'", "one table of rows");
}

TEST_CASE("a file of several networks: what lies beside them is left, layers within them are refused")
{
    const TemporaryFolder folder;
    const ModelSpec spec;
    const fs::path iteration = writeModel(folder.path(), spec);
    for (const char* name : {"opacity_mlp.pt", "cov_mlp.pt", "color_mlp.pt"})
        fs::remove(iteration / name);
    const WeightSet weights = makeWeights(spec.n_offsets, spec.feat_dim, {});
    const auto write = [&](const std::string& name, const std::string& key) {
        std::vector<NamedTensor> tensors = {{key, {2}, {1, 2}}};
        for (const char* network : {"opacity_mlp", "cov_mlp", "color_mlp"})
            for (NamedTensor tensor : stateDictOf(weights.mlps[network[1] == 'p' ? 0 : network[2] == 'v' ? 1 : 2])) {
                tensor.name.insert(0, std::string(network) + ".");
                tensors.push_back(tensor);
            }
        writeFile(iteration / name, writeTensorArchive(tensors));
    };
    for (const char* beside : {"optimizer.state.0.exp_avg", "opacity_mlp_accum", "xyz_gradient_accum"}) {
        write("checkpoints.pth", beside);
        CHECK(readCheckpoint(folder.path().string(), {}).mlps.size() == 3);
    }
    write("checkpoints.pth", "cov_mlp.4.weight");
    refuses(folder.path(), ErrorCode::Unsupported, "'cov_mlp.4.weight'", "no such layer");
    // a bank by the name of the other container is no other network
    fs::remove(iteration / "checkpoints.pth");
    write("checkpoint.pth", "feature_bank_mlp.0.weight");
    refuses(folder.path(), ErrorCode::Unsupported, "feature_bank_mlp.0.weight", "files the trainer wrote");
    fs::rename(iteration / "checkpoint.pth", iteration / "checkpoints.pth");
    write("checkpoints.pth", "mlp_feature_bank.0.weight");
    refuses(folder.path(), ErrorCode::Unsupported, "mlp_feature_bank.0.weight", "files the trainer wrote");
}

TEST_CASE("refusals: 'info' without 'level'")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.columns = Columns::Octree;
    const fs::path iteration = writeModel(folder.path(), spec);
    PlyText ply = makePly(Columns::Octree, 5, spec.n_offsets, spec.feat_dim);
    ply.columns[3] = "unknown";
    writeFile(iteration / "point_cloud.ply", ply.text());
    refuses(folder.path(), ErrorCode::InvalidFile, "column 'level' is missing", "that the trainer wrote");
}

TEST_CASE("refusals: a fault of an MLP names the file that holds it")
{
    const TemporaryFolder folder;
    const ModelSpec spec;
    const fs::path iteration = writeModel(folder.path(), spec);
    ModelSpec wide = spec;
    wide.n_offsets += 1;
    const TemporaryFolder other;
    const fs::path foreign = writeModel(other.path(), wide);
    for (const char* name : {"cov_mlp.pt", "color_mlp.pt"}) {
        const std::string kept = (iteration / name).string() + ".kept";
        fs::rename(iteration / name, kept);
        fs::copy_file(foreign / name, iteration / name);
        refuses(folder.path(), ErrorCode::InvalidFile, (std::string(name) + ": ").c_str(), "different models");
        fs::remove(iteration / name);
        fs::rename(kept, iteration / name);
    }
}

TEST_CASE("refusals: pipes and devices are not read from")
{
    for (const char* name : {"point_cloud.ply", "opacity_mlp.pt", "cov_mlp.pt"}) {
        const TemporaryFolder folder;
        const fs::path iteration = writeModel(folder.path(), {});
        fs::remove(iteration / name);
        REQUIRE(::mkfifo((iteration / name).c_str(), 0600) == 0);
        refuses(iteration, ErrorCode::Io, name, "no regular file");
        fs::remove(iteration / name);
        fs::create_symlink("/dev/zero", iteration / name);
        refuses(iteration, ErrorCode::Io, name, "no regular file");
    }
}

TEST_CASE("refusals: explicit Gaussians")
{
    const TemporaryFolder folder;
    PlyText ply;
    ply.columns = {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"};
    ply.rows.assign(2, std::vector<float>(10));
    writeFile(folder.path() / "m/point_cloud.ply", ply.text());
    refuses(folder.path() / "m", ErrorCode::Unsupported, "is a plain 3D Gaussian PLY", "train with Scaffold-GS");
    ply.columns[3] = "f_offset_0";
    writeFile(folder.path() / "m/point_cloud.ply", ply.text());
    refuses(folder.path() / "m", ErrorCode::Unsupported, "Octree-AnyGS model of explicit", "train with Scaffold-GS");
}

TEST_CASE("refusals: folders of other methods")
{
    const std::pair<const char*, const char*> markers[] = {{"sogs_config.json", "SOGS"},
                                                           {"second_order_mlp_0.pt", "SOGS"},
                                                           {"point_cloud_rk0_ws4.ply", "CityGS-X"},
                                                           {"_rk0opacity_mlp.pt", "CityGS-X"},
                                                           {"step-000029999.ckpt", "nerfstudio"}};
    for (const auto& [file, method] : markers) {
        const TemporaryFolder folder;
        const fs::path iteration = writeModel(folder.path(), {});
        writeFile(iteration / file, std::string("x"));
        refuses(folder.path(), ErrorCode::Unsupported, method, file);
        refuses(iteration / "point_cloud.ply", ErrorCode::Unsupported, method, file);
    }
    const TemporaryFolder folder;
    writeFile(folder.path() / "run/chkpnt30000.pth", std::string("x"));
    refuses(folder.path() / "run", ErrorCode::Unsupported, "state of a training run", "--save_iterations");
    refuses(folder.path() / "run/chkpnt30000.pth", ErrorCode::Unsupported, "state of a training run", "iteration_<n>");
    writeFile(folder.path() / "nerf/nerfstudio_models/step-1.ckpt", std::string("x"));
    refuses(folder.path() / "nerf", ErrorCode::Unsupported, "nerfstudio", "export");
}

TEST_CASE("refusals: missing and mixed-up files")
{
    const TemporaryFolder folder;
    const ModelSpec spec;
    const fs::path model = folder.path() / "m", iteration = writeModel(model, spec);
    refuses(folder.path() / "absent", ErrorCode::Io, "does not exist", "check the path");
    refuses(folder.path() / "m/cfg_args", ErrorCode::InvalidFile, "neither a folder nor a PLY", "point_cloud.ply");

    fs::rename(iteration / "point_cloud.ply", folder.path() / "kept.ply"); // .pt without PLY
    refuses(model, ErrorCode::InvalidFile, "opacity_mlp.pt", "expected point_cloud.ply");
    fs::rename(folder.path() / "kept.ply", iteration / "point_cloud.ply");

    fs::rename(iteration / "cov_mlp.pt", folder.path() / "kept.pt"); // two of three
    refuses(model, ErrorCode::InvalidFile, "cov_mlp.pt is missing", "copy the whole folder");
    fs::rename(folder.path() / "kept.pt", iteration / "cov_mlp.pt");
}

TEST_CASE("refusals: a PLY without weights, and weights of another model")
{
    const TemporaryFolder folder;
    const ModelSpec spec;
    const fs::path iteration = writeModel(folder.path() / "m", spec);
    fs::create_directories(folder.path() / "alone");
    fs::copy(iteration / "point_cloud.ply", folder.path() / "alone/point_cloud.ply");
    refuses(folder.path() / "alone", ErrorCode::InvalidFile, "checkpoints.pth", "opacity_mlp.pt");

    writeSplit(iteration, makeWeights(spec.n_offsets + 1, spec.feat_dim, {}));
    refuses(folder.path() / "m", ErrorCode::InvalidFile, "3 results", "different models");
    writeSplit(iteration, makeWeights(spec.n_offsets, spec.feat_dim + 4, {}));
    refuses(folder.path() / "m", ErrorCode::InvalidFile, "8 hidden values", "different models");
    writeSplit(iteration, makeWeights(spec.n_offsets, spec.feat_dim, {2, 2, 2}));
    refuses(folder.path() / "m", ErrorCode::Unsupported, "takes 9 values", "only the MLPs of Scaffold-GS");

    WeightSet swapped = makeWeights(spec.n_offsets, spec.feat_dim, {});
    swapped.mlps[0].activation = Activation::Sigmoid; // an opacity MLP that ends in another activation
    writeSplit(iteration, swapped);
    refuses(folder.path() / "m", ErrorCode::Unsupported, "layer 3 is Sigmoid", "only the MLPs");

    writeFile(iteration / "opacity_mlp.pt", std::string("\x80\x02\x8a\x0al\xfc\x9c"));
    refuses(folder.path() / "m", ErrorCode::InvalidFile, "magic number of torch.save", "copy the file again");
    writeFile(iteration / "opacity_mlp.pt", std::string(100, 'x'));
    refuses(folder.path() / "m", ErrorCode::InvalidFile, "opacity_mlp.pt", "save it again");

    PlyText none = makePly(Columns::Scaffold, 0, spec.n_offsets, spec.feat_dim);
    writeFile(iteration / "point_cloud.ply", none.text());
    refuses(folder.path() / "m", ErrorCode::InvalidFile, "has no vertices", "at least one");
}
