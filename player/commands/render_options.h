// SPDX-License-Identifier: Apache-2.0
// Options that play, bench and stability have in common, as CLI11 declares them. One value is checked as it
// is read; checkRenderOptions() checks several together.
#pragma once

#include "runtime/records/score_options.h"
#include "player/options/play_options.h"
#include "runtime/cli/options.h"

#include <string>

namespace gsc {

void addFile(CLI::App& app, PlayOptions& options);
void addCameras(CLI::App& app, PlayOptions& options);
void addCameraReading(CLI::App& app, PlayOptions& options); // how camera files are read
void addFrames(CLI::App& app, PlayOptions& options);        // --frames A:B
// Size, angle, eyes, and those of addLookOptions().
void addViewOptions(CLI::App& app, PlayOptions& options, const std::string& size = "the camera's");
void addLookOptions(CLI::App& app, PlayOptions& options); // colours, and how two eyes are drawn
// Whose views are drawn: cameras in turn, or where a person is.
enum class Views { Cameras, Window, Headset };
// Tier, backend, memory, foveation, reuse, detail, levels.
void addRunOptions(CLI::App& app, PlayOptions& options, Views views = Views::Cameras);
// Adds --shard; `what`: the work that is split, "the frames". Every shard keeps its finished work in `file`, "--stats".
void addShard(CLI::App& app, PlayOptions& options, const char* what, const char* file);
void addScoreFrames(CLI::App& app, ScoreOptions& score); // --score-every, --score-first
void addTargetOption(CLI::App& app, PlayOptions& options, Views views = Views::Cameras);
void addFirstPicture(CLI::App& app, PlayOptions& options); // draws while the model loads
void settleFirstPicture(PlayOptions& options);             // after parsing: tier exact waits for the file

// A backend by name, or "auto" too: the names of every build; one that this build lacks is refused when it is opened.
OptionHandle addBackend(CLI::App& app, const char* name, std::string& field, bool or_auto, const char* help);

// --shard needs a `file` for finished work, named by `option`. Throws Error(Usage).
void checkShardFile(const PlayOptions& options, const char* option, const std::string& file);

// The option that asks for detail. Precondition: one does.
const char* detailOption(const CLI::App& app);

// Checks options that have an effect with two eyes only: --ipd, --stereo merged. Throws Error(Usage).
void checkEyes(const CLI::App& app, const PlayOptions& options, bool takes_two_eyes = false);

// `paths_follow`: cameras are read from files that are not known yet. `takes_two_eyes`: whatever --eyes says.
// Throws Error(Usage).
void checkRenderOptions(const CLI::App& app, const PlayOptions& options, bool paths_follow,
                        bool takes_two_eyes = false);

// Throws Error(Usage) if `option` was given and `has_effect` is false; `needs`: the options it needs.
void checkEffect(const CLI::App& app, const char* option, bool has_effect, const std::string& needs);

} // namespace gsc
