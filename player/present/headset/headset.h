// SPDX-License-Identifier: Apache-2.0
// Brings finished pictures to a headset through OpenXR and Vulkan: the module gsc_headset, loaded when it is first used, so
// that the player starts where there is no OpenXR. All calls but locate() from one thread, which owns the session and its queue.
// Poses are in the headset's space, times OpenXR's: nanoseconds of a clock of the runtime's own.
#pragma once

#include <gsc/frame_target.h>
#include "player/present/presenter.h"
#include "player/poses/placement.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

struct HeadsetOptions {
    std::optional<DeviceUuid> device; // the GPU that draws
    double scale = 1;                 // width and height of pictures, in times the recommended ones
    bool stage = false;               // the space: STAGE, whose floor is at 0; otherwise LOCAL, whose eyes are at 0
    bool depth = false;               // pictures go with their depths, where the runtime takes them
};

struct HeadsetView {
    uint32_t width = 0, height = 0; // size of pictures, pixels
    std::optional<double> hidden;   // share of pixels that the lens hides, 0 to 1, as the player computes it
    uint32_t recommended_width = 0, recommended_height = 0;
    uint32_t most_width = 0, most_height = 0;
};

struct HeadsetFacts {
    std::string loader, runtime, headset, gpu; // names; the first two with their version
    bool draws = false;                        // the headset's GPU is the one asked for, and shares memory with it
    std::string configuration;                 // "stereo", "mono" or "quad"
    std::vector<HeadsetView> views;
    std::vector<std::string> formats;        // formats of pictures, in the runtime's order
    std::string format;                      // format chosen among them
    PixelFormat pixels = PixelFormat::Rgba8; // pixels that pictures must have for it: Rgba8 or Bgra8
    std::vector<std::string> spaces;
    std::vector<std::string> extensions;
    bool tracks_gaze = false;
    bool tells_mask = false;  // the runtime tells which part of a view its lens hides
    bool takes_depth = false; // depths go with pictures: they were asked for, and the runtime takes them
};

// Triangles of a view that its lens hides. Counts and values are the runtime's, unchecked.
struct HiddenMesh {
    std::vector<std::array<float, 2>> vertices; // right and up at depth 1
    std::vector<uint32_t> indices;
    std::string fault; // why meshes that the runtime has are not used; empty: there is no fault
};

enum class HeadsetState : uint32_t {
    Idle,    // no frames are wanted; they may be later
    Running, // beginFrame() is to be called
    Over,    // the person or the runtime ended it
    Lost,    // the runtime or the headset has gone
};

struct HeadsetFrame {
    int64_t display_time = 0; // time at which the submitted picture is displayed
    int64_t period = 0;       // ns from one refresh to the next
    bool visible = false;     // pictures are wanted
};

// One hand's controller. A button or stick that it lacks is 0.
struct HandInput {
    std::optional<SpacePose> grip, aim;  // none: not tracked
    double grab = 0;                     // 0 to 1
    double stick[2] = {};                // right and forward, -1 to 1
    bool teleport = false, menu = false; // held down
};

struct HeadsetInput {
    HandInput hands[2]; // left, right
    std::optional<SpacePose> gaze;
};

// A picture for each view, and where its eye was.
struct HeadsetPictures {
    std::span<const ShownPicture> pictures;
    std::span<const SpaceEye> eyes;
    double metre = 1; // world units in a metre of the space, for depths
};

class Headset : public SharedMemory {
public:
    [[nodiscard]] virtual const HeadsetFacts& facts() const = 0;

    // Makes the images that pictures are copied to. Call once, before the first poll(). Throws Error: Unsupported if
    // the runtime takes no format that keeps colours as they are; OutOfMemory.
    virtual void prepare() = 0;

    // Handles the runtime's events; begins and ends the session as the runtime asks.
    virtual HeadsetState poll() = 0;
    virtual bool spaceMoved() = 0; // true if the space moved since the last call: earlier poses then mean other places
    // Hidden mesh of a view, as the runtime stated last. Empty if the lens hides nothing or the runtime states nothing.
    [[nodiscard]] virtual const HiddenMesh& hidden(size_t view) const = 0;
    virtual bool hiddenChanged() = 0; // since the last call
    virtual void requestExit() = 0;   // the session ends as if the person had ended it

    // A time of OpenXR's clock at which eyes may be located without a frame; 0 where the runtime tells none.
    virtual int64_t now() = 0;

    // All functions below throw Error(Device) where the runtime or the headset have gone.

    virtual HeadsetFrame beginFrame() = 0; // waits until the runtime wants the next
    // Locates the eyes at a time, one per view. Returns false if the headset is not tracked, which leaves `eyes`
    // unchanged. May be called from any thread.
    virtual bool locate(int64_t time, std::vector<SpaceEye>& eyes) = 0;
    virtual HeadsetInput input(int64_t time) = 0;
    // Takes the newest pictures, once: each is copied to where the headset reads, and shown by every endFrame() from
    // then on. Their memory is read until the next call, or finish().
    virtual void take(const HeadsetPictures& pictures) = 0;
    virtual void endFrame(bool shows) = 0; // the pictures taken last, if there are some, or nothing
    virtual void finish() = 0;             // waits until no picture is being read

    [[nodiscard]] virtual double copyMs() const = 0; // GPU time of the last copy that has ended; 0 = unknown
};

struct HeadsetFunctions {
    // Throws Error: Unsupported without a runtime, a headset, a Vulkan device or the space that is wanted, naming which;
    // Device.
    std::unique_ptr<Headset> (*open)(const HeadsetOptions& options);
};

} // namespace gsc
