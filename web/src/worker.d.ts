declare module "*?worker&inline" {
  const OwnWorker: new () => Worker;
  export default OwnWorker;
}
