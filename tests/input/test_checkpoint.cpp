// SPDX-License-Identifier: Apache-2.0
#include "convert/input/checkpoint.h"
#include "tests/input/model_fixture.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>

using namespace gsc;
using namespace gsc::test;

namespace fs = std::filesystem;

namespace {

void removeWeights(const fs::path& folder)
{
    for (const char* name :
         {"opacity_mlp.pt", "cov_mlp.pt", "color_mlp.pt", "feature_bank_mlp.pt", "embedding_appearance.pt"})
        fs::remove(folder / name);
}

void checkSameMlps(const std::vector<Mlp>& actual, const std::vector<Mlp>& expected)
{
    REQUIRE(actual.size() == expected.size());
    for (size_t i = 0; i < actual.size(); ++i) {
        CHECK(actual[i].kind == expected[i].kind);
        CHECK(actual[i].activation == expected[i].activation);
        for (int layer = 0; layer < 2; ++layer) {
            CHECK(actual[i].layers[layer].in == expected[i].layers[layer].in);
            CHECK(actual[i].layers[layer].weight == expected[i].layers[layer].weight);
            CHECK(actual[i].layers[layer].bias == expected[i].layers[layer].bias);
        }
    }
}

constexpr uint32_t kHead = kMlpTakesFeature;

} // namespace

TEST_CASE("checkpoint, trap 1: .pt files, checkpoints.pth and checkpoint.pth hold the same MLPs")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.widths = {1, 1, 1, 1, 6, 2};
    const fs::path iteration = writeModel(folder.path(), spec);
    const WeightSet weights = makeWeights(spec.n_offsets, spec.feat_dim, spec.widths);

    const Checkpoint split = read(folder.path());
    CHECK(split.container == "split");
    CHECK(split.family == ModelFamily::ScaffoldGs);
    CHECK(split.weight_paths.size() == 5);
    checkSameMlps(split.mlps, weights.mlps);
    CHECK(split.embedding == weights.embedding);
    CHECK(split.appearance_dim == 2);

    removeWeights(iteration);
    writeUnite(iteration, weights);
    const Checkpoint unite = read(folder.path());
    CHECK(unite.container == "unite");
    CHECK(unite.family == ModelFamily::ScaffoldGs);
    checkSameMlps(unite.mlps, weights.mlps);
    CHECK(unite.embedding == weights.embedding);

    fs::remove(iteration / "checkpoints.pth");
    WeightSet old = makeWeights(spec.n_offsets, spec.feat_dim, {1, 1, 1, 1, 0, 0}); // no embeddings at that time
    writeV1(iteration, old);
    const Checkpoint v1 = read(folder.path());
    CHECK(v1.container == "v1");
    CHECK(v1.family == ModelFamily::ScaffoldGsV1);
    checkSameMlps(v1.mlps, old.mlps);
    CHECK((v1.flags & kModelFeatureBank) != 0);

    writeSplit(iteration, weights);
    CHECK(warns(read(folder.path()), "weights more than once"));
}

TEST_CASE("checkpoint, trap 2: widths decide what an MLP takes, not cfg_args")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.cfg_args = "Namespace(voxel_size=0.25, add_opacity_dist=False, add_cov_dist=False, add_color_dist=False)";
    spec.widths = {1, 0, 1};
    writeModel(folder.path(), spec);
    const Checkpoint checkpoint = read(folder.path());
    CHECK(checkpoint.mlps[0].inputs == (kHead | kMlpTakesDistance));
    CHECK(checkpoint.mlps[1].inputs == kHead);
    CHECK(checkpoint.mlps[2].inputs == (kHead | kMlpTakesDistance));
    CHECK(warns(checkpoint, "add_opacity_dist is False"));
    CHECK_FALSE(warns(checkpoint, "add_cov_dist"));
}

TEST_CASE("checkpoint, trap 2: Scaffold-GS before 2024 takes the distance everywhere without saying so")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.cfg_args = "Namespace(sh_degree=3, voxel_size=0.001, eval=True, lod=0)";
    spec.widths = {1, 1, 1};
    const fs::path iteration = writeModel(folder.path(), spec);
    removeWeights(iteration);
    writeV1(iteration, makeWeights(spec.n_offsets, spec.feat_dim, spec.widths));
    const Checkpoint checkpoint = read(folder.path());
    for (const Mlp& mlp : checkpoint.mlps)
        CHECK(mlp.inputs == (kHead | kMlpTakesDistance));
    CHECK(checkpoint.voxel_size == 0.001f);
    CHECK(checkpoint.level_rule == LevelRule::None);
    CHECK(checkpoint.flags == 0);
}

TEST_CASE("checkpoint: the feature bank takes the distance in Scaffold-GS, the level or nothing in Octree-GS")
{
    struct Case {
        Columns columns;
        MlpWidths widths;
        uint32_t flags, bank_inputs, head_inputs;
    };
    const Case cases[] = {
        {Columns::Scaffold, {0, 0, 0, 1, 0, 0}, kModelBankDistance, kMlpTakesDistance, kHead},
        {Columns::Octree, {0, 0, 0, 0, 0, 0}, 0, 0, kHead},
        {Columns::Octree, {1, 1, 1, 0, 0, 0}, 0, 0, kHead | kMlpTakesDistance},
        {Columns::Octree, {1, 1, 1, 1, 0, 0}, kModelBankLevel, kMlpTakesLevel, kHead | kMlpTakesLevel},
        {Columns::Octree,
         {2, 2, 2, 1, 0, 0},
         kModelBankLevel,
         kMlpTakesLevel,
         kHead | kMlpTakesLevel | kMlpTakesDistance},
        {Columns::AnyLod, {0, 0, 0, 0, 0, 0}, 0, 0, kHead},
    };
    for (const Case& test : cases) {
        const TemporaryFolder folder;
        ModelSpec spec;
        spec.columns = test.columns;
        spec.widths = test.widths;
        spec.cfg_args = "Namespace(fork=2, dist2level='round')";
        writeModel(folder.path(), spec);
        const Checkpoint checkpoint = read(folder.path());
        REQUIRE(checkpoint.mlps.size() == 4);
        CHECK((checkpoint.flags & (kModelFeatureBank | kModelBankDistance | kModelBankLevel)) ==
              (kModelFeatureBank | test.flags));
        CHECK(checkpoint.mlps[3].inputs == test.bank_inputs);
        CHECK(checkpoint.mlps[0].inputs == test.head_inputs);
    }
}

TEST_CASE("checkpoint: one extra input of Octree-GS is the distance or the level")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.columns = Columns::Octree;
    spec.widths = {1, 1, 1};
    spec.cfg_args = "";
    writeModel(folder.path(), spec);
    const Outcome outcome = outcomeOf([&] { (void)read(folder.path()); });
    CHECK(outcome.code == ErrorCode::InvalidFile);
    CHECK(outcome.says("--add-level"));

    CheckpointOptions options;
    for (const int add_level : {0, 1}) {
        options.add_level = add_level;
        const uint32_t expected = kHead | (add_level ? uint32_t(kMlpTakesLevel) : uint32_t(kMlpTakesDistance));
        for (const Mlp& mlp : read(folder.path(), options).mlps)
            CHECK(mlp.inputs == expected);
        writeFile(folder.path() / "cfg_args",
                  std::string("Namespace(fork=2, dist2level='round', add_level=") + (add_level ? "True)" : "False)"));
        CHECK(read(folder.path()).mlps[0].inputs == expected);
        CHECK(read(folder.path(), options).mlps[0].inputs == expected);
        options.add_level = 1 - add_level;
        const Outcome contradiction = outcomeOf([&] { (void)read(folder.path(), options); });
        CHECK(contradiction.code == ErrorCode::Usage);
        CHECK(contradiction.says(add_level ? "add_level is True" : "add_level is False"));
        CHECK(contradiction.says(add_level ? "--add-level 0" : "--add-level 1"));
        fs::remove(folder.path() / "cfg_args");
    }
    // a model whose widths differ leaves no choice
    writeSplit(folder.path() / "point_cloud" / "iteration_7", makeWeights(spec.n_offsets, spec.feat_dim, {1, 0, 1}));
    options.add_level = 1;
    CHECK(outcomeOf([&] { (void)read(folder.path(), options); }).code == ErrorCode::Usage);
    CHECK(read(folder.path()).mlps[0].inputs == (kHead | kMlpTakesDistance));
    writeSplit(folder.path() / "point_cloud" / "iteration_7", makeWeights(spec.n_offsets, spec.feat_dim, {2, 1, 1}));
    const Checkpoint both = read(folder.path());
    CHECK(both.mlps[0].inputs == (kHead | kMlpTakesDistance | kMlpTakesLevel));
    CHECK(both.mlps[1].inputs == (kHead | kMlpTakesLevel));
}

TEST_CASE("checkpoint, trap 9: Octree-GS keeps voxel_size and standard_dist in the first two rows of 'info'")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.columns = Columns::Octree;
    const fs::path iteration = writeModel(folder.path(), spec);
    const Checkpoint checkpoint = read(folder.path());
    CHECK(checkpoint.family == ModelFamily::OctreeGs);
    CHECK(checkpoint.voxel_size == 0.125f);
    CHECK(checkpoint.standard_dist == 40.5f);
    CHECK(checkpoint.flags == (kModelHasLevels | kModelLodHalfCell));
    CHECK(checkpoint.raster_rules == RasterRules::DiffGaussian);

    PlyText sorted = makePly(Columns::Octree, 5, spec.n_offsets, spec.feat_dim);
    std::reverse(sorted.rows.begin(), sorted.rows.end());
    writeFile(iteration / "point_cloud.ply", sorted.text());
    const Outcome outcome = outcomeOf([&] { (void)read(folder.path()); });
    CHECK(outcome.code == ErrorCode::InvalidFile);
    CHECK(outcome.says("sorted, filtered or merged"));
    writeFile(iteration / "point_cloud.ply", makePly(Columns::Octree, 1, spec.n_offsets, spec.feat_dim).text());
    CHECK(outcomeOf([&] { (void)read(folder.path()); }).says("at least two"));
}

TEST_CASE("checkpoint, trap 10: the clamp is max - min of the levels in the file")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.columns = Columns::Octree;
    const fs::path iteration = writeModel(folder.path(), spec);
    CHECK(read(folder.path()).level_clamp == 2);
    CHECK(read(folder.path()).level_min == 0);
    PlyText ply = makePly(Columns::Octree, 5, spec.n_offsets, spec.feat_dim);
    for (size_t row = 0; row < ply.rows.size(); ++row)
        ply.at(row, "level") = row < 3 ? 2.0f : 5.0f; // level 0 and 1 were pruned
    writeFile(iteration / "point_cloud.ply", ply.text());
    const Checkpoint checkpoint = read(folder.path());
    CHECK(checkpoint.level_min == 2);
    CHECK(checkpoint.level_clamp == 3); // so level 5 can never be selected; upstream drops it too
    CHECK(warns(checkpoint, "levels above 3"));
    ply.at(4, "level") = float(kMaxLevels) - 1;
    writeFile(iteration / "point_cloud.ply", ply.text());
    CHECK(read(folder.path()).level_clamp == int32_t(kMaxLevels) - 3);
    ply.at(4, "level") = float(kMaxLevels);
    writeFile(iteration / "point_cloud.ply", ply.text());
    CHECK(outcomeOf([&] { (void)read(folder.path()); }).says("level of vertex 4 is 64, expected 0 to 63"));
}

TEST_CASE("checkpoint, trap 14: 'progressive' as a flag is not 'progressive' as a level rule")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.columns = Columns::Octree;
    spec.cfg_args = "Namespace(fork=3, dist2level='floor', progressive=True, white_background=True)";
    writeModel(folder.path(), spec);
    const Checkpoint checkpoint = read(folder.path());
    CHECK(checkpoint.level_rule == LevelRule::Floor);
    CHECK(checkpoint.fork == 3);
    CHECK((checkpoint.flags & kModelWhiteBackground) != 0);
    CheckpointOptions options;
    options.level_rule = int(LevelRule::Floor);
    options.fork = 3;
    CHECK(read(folder.path(), options).level_rule == LevelRule::Floor); // says the same twice
    CHECK(read(folder.path(), options).fork == 3);
    options.level_rule = int(LevelRule::Progressive);
    const Outcome rule = outcomeOf([&] { (void)read(folder.path(), options); });
    CHECK(rule.code == ErrorCode::Usage);
    CHECK(rule.says("dist2level is 'floor'"));
    CHECK(rule.says("--dist2level progressive"));
    options = {};
    options.fork = 2;
    const Outcome fork = outcomeOf([&] { (void)read(folder.path(), options); });
    CHECK(fork.code == ErrorCode::Usage);
    CHECK(fork.says("fork is 3"));
    CHECK(fork.says("--fork 2"));
    for (const int typed : {-2, 1, 65}) {
        options.fork = typed;
        const Outcome range = outcomeOf([&] { (void)read(folder.path(), options); });
        CHECK(range.code == ErrorCode::Usage);
        CHECK(range.says("from 2 to 64"));
        CHECK_FALSE(range.says("cfg_args"));
    }
    writeFile(folder.path() / "cfg_args", std::string("Namespace(dist2level='nearest')"));
    CHECK(outcomeOf([&] { (void)read(folder.path()); }).says("dist2level is 'nearest'"));
    writeFile(folder.path() / "cfg_args", std::string("Namespace(fork=100)"));
    CHECK(outcomeOf([&] { (void)read(folder.path()); }).code == ErrorCode::Unsupported);
    CHECK(outcomeOf([&] { (void)read(folder.path()); }).says("cfg_args: fork is 100"));
    fs::remove(folder.path() / "cfg_args");
    options.fork = 5;
    options.level_rule = int(LevelRule::Ceil);
    CHECK(read(folder.path(), options).fork == 5);
    CHECK(read(folder.path(), options).level_rule == LevelRule::Ceil);
    options.level_rule = int(LevelRule::Floor);
    CHECK(read(folder.path(), options).level_rule == LevelRule::Floor);
    const Checkpoint bare = read(folder.path());
    CHECK(bare.level_rule == LevelRule::Round);
    CHECK(warns(bare, "--dist2level"));
    CHECK(warns(bare, "--fork"));
}

TEST_CASE("checkpoint, trap 32: voxel_size <= 0 means derived, and lost")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    for (const char* value : {"0", "-1", "0.0"}) {
        spec.cfg_args = std::string("Namespace(voxel_size=") + value + ")";
        writeModel(folder.path(), spec);
        CHECK(read(folder.path()).voxel_size == 0);
    }
}

TEST_CASE("checkpoint: Octree-AnyGS, base and with levels")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.columns = Columns::AnyBase;
    spec.cfg_args = "";
    writeModel(folder.path() / "base", spec);
    writeFile(folder.path() / "base" / "config.yaml",
              std::string("model_params: {model_config: {name: \"GaussianModel\", kwargs: {voxel_size: 0.5}}, "
                          "white_background: True}\n"));
    const Checkpoint base = read(folder.path() / "base");
    CHECK(base.family == ModelFamily::OctreeAnyGs);
    CHECK(base.raster_rules == RasterRules::Gsplat);
    CHECK(base.flags == kModelWhiteBackground);
    CHECK(base.voxel_size == 0.5f);
    CHECK(base.cfg_args.find("GaussianModel") != std::string::npos);

    spec.columns = Columns::AnyLod;
    spec.rows = 4;
    spec.cfg_args = "Namespace(model_config={'name': 'GaussianLoDModel', 'kwargs': {'fork': 4, 'dist2level': 'ceil', "
                    "'progressive': False}}, base_model='scaffoldgs', white_background=False)";
    writeModel(folder.path() / "lod", spec);
    const Checkpoint lod = read(folder.path() / "lod");
    CHECK(lod.family == ModelFamily::OctreeAnyGs);
    CHECK(lod.flags == kModelHasLevels); // measured from the anchor itself, not half a cell beside it
    CHECK(lod.level_rule == LevelRule::Ceil);
    CHECK(lod.fork == 4);
    CHECK(lod.standard_dist == 12.345679f); // six decimals of the header, trap 9
    CHECK(lod.level_clamp == 2);
    CHECK(lod.voxel_size == 0);
    CHECK(outcomeOf([&] {
              PlyText ply = makePly(Columns::AnyLod, 4, spec.n_offsets, spec.feat_dim);
              ply.obj_info.pop_back();
              writeFile(folder.path() / "lod/point_cloud/iteration_7/point_cloud.ply", ply.text());
              (void)read(folder.path() / "lod");
          }).says("obj_info levels"));
}

TEST_CASE("checkpoint, trap 34: Octree-AnyGS keeps its coarse-to-fine limit, Octree-GS does not")
{
    // 6 levels, start at 2: three steps whose ends are 10000 / 2.111 * (1, 1 + 2/3, 1 + 2/3 + 4/9) = 4737, 7895, 10000
    const std::pair<int, int> expected[] = {{4000, 2}, {5000, 3}, {8000, 4}, {10001, 5}, {30000, 5}};
    for (const auto& [iteration, clamp] : expected) {
        const TemporaryFolder folder;
        ModelSpec spec;
        spec.columns = Columns::AnyLod;
        spec.iteration = iteration;
        spec.cfg_args = "";
        const fs::path path = writeModel(folder.path(), spec);
        PlyText ply = makePly(Columns::AnyLod, 5, spec.n_offsets, spec.feat_dim);
        ply.obj_info[1] = "levels 6.000000";
        writeFile(path / "point_cloud.ply", ply.text());
        writeFile(folder.path() / "config.yaml",
                  std::string("model_params: {model_config: {kwargs: {fork: 2, dist2level: 'round', progressive: True, "
                              "init_level: 2}}}\noptim_params: {coarse_iter: 10_000, coarse_factor: 1.5}\n"));
        CHECK(read(folder.path()).level_clamp == clamp);
        writeFile(
            folder.path() / "config.yaml",
            std::string("model_params: {model_config: {kwargs: {fork: 2, dist2level: 'round', progressive: False}}}"
                        "\noptim_params: {coarse_iter: 10_000, coarse_factor: 1.5}\n"));
        CHECK(read(folder.path()).level_clamp == 5);
    }
}

TEST_CASE("checkpoint, trap 34: without the level that training starts at it is the middle one")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.columns = Columns::AnyLod;
    spec.iteration = 1; // before the first step
    spec.cfg_args = "";
    const fs::path path = writeModel(folder.path(), spec);
    PlyText ply = makePly(Columns::AnyLod, 5, spec.n_offsets, spec.feat_dim);
    ply.obj_info[1] = "levels 6.000000";
    writeFile(path / "point_cloud.ply", ply.text());
    const auto clampFor = [&](const std::string& stated, const std::string& optim) {
        writeFile(folder.path() / "config.yaml",
                  "model_params: {model_config: {kwargs: {fork: 2, dist2level: 'round', progressive: True" + stated +
                      "}}}\noptim_params: {" + optim + "}\n");
        return read(folder.path()).level_clamp;
    };
    const std::string steps = "coarse_iter: 10_000, coarse_factor: 1.5";
    CHECK(clampFor(", init_level: 0", steps) == 0);
    CHECK(clampFor(", init_level: 4", steps) == 4);
    CHECK(clampFor(", init_level: -1", steps) == 3);
    CHECK(clampFor(", init_level: 64", steps) == 3);
    CHECK(clampFor("", steps) == 3);
    CHECK(clampFor(", init_level: 2", "iterations: 40_000") == 5); // nothing says how long a step takes
    CHECK(warns(read(folder.path()), "taken as trained to the end"));
}

TEST_CASE("checkpoint: a header number of Octree-AnyGS that is none is refused")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.columns = Columns::AnyLod;
    const fs::path path = writeModel(folder.path(), spec);
    const auto refusal = [&](size_t line, const std::string& text) {
        PlyText ply = makePly(Columns::AnyLod, 5, spec.n_offsets, spec.feat_dim);
        ply.obj_info[line] = text;
        writeFile(path / "point_cloud.ply", ply.text());
        return outcomeOf([&] { (void)read(folder.path()); });
    };
    for (const char* number : {"", "x", "0", "-1", "nan", "inf"})
        CHECK(refusal(0, std::string("standard_dist ") + number).says("obj_info standard_dist <positive number>"));
    for (const char* number : {"0.4", "65", "1e9"})
        CHECK(refusal(1, std::string("levels ") + number).says("levels, expected 1 to 64"));
    for (const char* number : {"0.6", "1", "64"})
        CHECK(refusal(1, std::string("levels ") + number).code == ErrorCode::Ok);
}

TEST_CASE("checkpoint: settings of the trainer may have 1 MiB")
{
    const TemporaryFolder folder;
    writeModel(folder.path(), {});
    const std::string settings = ModelSpec().cfg_args;
    writeFile(folder.path() / "cfg_args", settings + std::string((1 << 20) - settings.size(), ' '));
    CHECK(read(folder.path()).cfg_args.size() == 1 << 20);
    writeFile(folder.path() / "cfg_args", settings + std::string((1 << 20) - settings.size() + 1, ' '));
    CHECK(outcomeOf([&] { (void)read(folder.path()); }).code == ErrorCode::InvalidFile);
}

TEST_CASE("checkpoint: an embedding that colour does not take is left out, one that it needs is asked for")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.widths.appearance_rows = 9;
    spec.widths.appearance_columns = 5;
    const fs::path iteration = writeModel(folder.path(), spec);
    CHECK(read(folder.path()).mlps[2].inputs == (kHead | kMlpTakesAppearance));
    CHECK(read(folder.path()).embedding.size() == 45);
    fs::remove(iteration / "embedding_appearance.pt");
    const Outcome outcome = outcomeOf([&] { (void)read(folder.path()); });
    CHECK(outcome.code == ErrorCode::InvalidFile);
    CHECK(outcome.says("embedding_appearance.pt"));

    WeightSet weights = makeWeights(spec.n_offsets, spec.feat_dim, spec.widths);
    weights.mlps[2] = makeWeights(spec.n_offsets, spec.feat_dim, {}).mlps[2];
    writeSplit(iteration, weights);
    const Checkpoint unused = read(folder.path());
    CHECK(unused.appearance_dim == 0);
    CHECK(unused.embedding.empty());
    CHECK(unused.mlps[2].inputs == kHead);
    CHECK(warns(unused, "left out"));
}
