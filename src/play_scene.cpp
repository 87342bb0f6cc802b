// Plays a scene's drive into base_node. Ends when the scene is over.

#include "youbot_base_sim/ros/program.h"
#include "youbot_base_sim/ros/scene_player.h"

int main(int argc, char** argv) {
  using namespace youbot_base_sim;
  return run_program(argc, argv, "play_scene", [] { ScenePlayer(read_player_settings()).run(); });
}
